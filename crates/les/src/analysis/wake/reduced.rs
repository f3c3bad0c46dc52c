//! Records in the units of the pair, for tests.

use super::record::{SecondaryRecord, VortexRecord, WakeRecord, WakeScales};

impl WakeRecord {
    /// The same numbers in the units of the pair: lengths in `b0`, velocities in `V0`, times in
    /// `b0/V0`; circulations in `b0 V0 = Gamma0/(2 pi)`.
    pub(crate) fn reduced(&self, scales: &WakeScales) -> Self {
        let length = 1.0 / scales.spacing_m;
        let time = 1.0 / scales.time_unit_s();
        let speed = length / time;
        let area = (length * speed).powi(2);
        Self {
            time_s: self.time_s * time,
            left: self.left.scaled(length, time),
            right: self.right.scaled(length, time),
            energy_m4_s2: self.energy_m4_s2 * area,
            mode_energy_m4_s2: self.mode_energy_m4_s2.iter().map(|e| e * area).collect(),
            enstrophy_m2_s2: self.enstrophy_m2_s2 * speed * speed,
            wall_shear_per_s: self.wall_shear_per_s / time,
            wall_units: self.wall_units,
        }
    }
}

impl VortexRecord {
    fn scaled(&self, length: f64, time: f64) -> Self {
        let gamma = length * length / time;
        let second = &self.secondary;
        let slices_m = self.slices_m.iter();
        let slices_m = slices_m.map(|[y_m, z_m]| [y_m * length, z_m * length]);
        let profile = self.gamma_m2_s.iter().map(|g| g * gamma);
        Self {
            y_m: self.y_m * length,
            z_m: self.z_m * length,
            slices_m: slices_m.collect(),
            y_spread_m: self.y_spread_m * length,
            z_spread_m: self.z_spread_m * length,
            gamma_5_15_m2_s: self.gamma_5_15_m2_s * gamma,
            gamma_m2_s: profile.collect(),
            gamma_opposite_m2_s: self.gamma_opposite_m2_s * gamma,
            secondary: SecondaryRecord {
                y_m: second.y_m * length,
                z_m: second.z_m * length,
                y_spread_m: second.y_spread_m * length,
                z_spread_m: second.z_spread_m * length,
                gamma_m2_s: second.gamma_m2_s * gamma,
            },
            outward_shear_per_s: self.outward_shear_per_s / time,
        }
    }
}
