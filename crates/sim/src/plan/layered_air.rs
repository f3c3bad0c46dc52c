//! The air along each line of sight of a scene whose aerosol or refractive turbulence changes with height.
//!
//! Aerosol is that of the elevation of each line. Cn2 is that of a group of elevations over which the coherence radius changes by
//! at most 2 %, so that efficiencies and phase screens are computed once for each group. Check: groups of a vertical scan.

use crate::Error;
use crate::beams::Schedule;
use crate::plan::Plan;
use crate::plan::instrument::Instrument;
use crate::scene::Scene;
use std::cmp::Ordering;
use wakescope_optics as optics;

/// Largest ratio of coherence radii within a group.
const SIMILAR: f64 = 1.02;

/// Aerosol and turbulence of each line of sight; empty where all lines have the same.
#[derive(Debug, Default)]
pub(crate) struct LayeredAir {
    /// The instrument with the air of each distinct slant.
    instruments: Vec<Instrument>,
    /// Index of the group of equal turbulence of each slant.
    group_of_slant: Vec<usize>,
    /// Index of the slant of each line.
    slant_of_line: Vec<usize>,
}

/// A distinct place and elevation of a beam: height, m, and elevation, rad.
type Slant = [f64; 2];

/// By elevation, then height.
fn order(a: &Slant, b: &Slant) -> Ordering {
    a[1].total_cmp(&b[1]).then(a[0].total_cmp(&b[0]))
}

impl LayeredAir {
    /// The air of the lines of a scan.
    ///
    /// # Errors
    /// What optics or signals refuse; a checked scene gives none.
    pub(crate) fn new(
        scene: &Scene,
        instrument: &Instrument,
        schedule: &Schedule,
    ) -> Result<Self, Error> {
        if !scene.has_layered_air() {
            return Ok(Self::default());
        }
        let of_lines: Vec<Slant> = (0..schedule.lines.len())
            .map(|line| schedule.middle(line))
            .map(|beam| [beam.position_m[2], beam.elevation_rad])
            .collect();
        let mut slants = of_lines.clone();
        slants.sort_by(order);
        slants.dedup();
        let groups = groups(scene, &slants)?;
        let mut air = Self::default();
        for (group, slants) in groups.iter().enumerate() {
            let [height_m, elevation_rad] = slants[slants.len() / 2];
            let turbulence = scene
                .refractive_turbulence()
                .map(|t| t.along(height_m, elevation_rad))
                .transpose()?;
            for slant in slants {
                air.group_of_slant.push(group);
                air.instruments.push(Instrument {
                    air: instrument.air.along(slant[0], slant[1]),
                    turbulence: turbulence.clone(),
                    ..instrument.clone()
                });
            }
        }
        if !scene.atmosphere.has_layered_aerosol() {
            for of_line in &mut air.instruments {
                of_line.air = instrument.air.clone();
            }
        }
        for slant in &of_lines {
            let position = slants.binary_search_by(|other| order(other, slant));
            air.slant_of_line.push(position.unwrap_or(0));
        }
        Ok(air)
    }

    /// The air of the line in the middle of the scan, which budget, bound and profile have.
    pub(crate) fn of_middle_line(&self) -> Option<&Instrument> {
        let slant = *self.slant_of_line.get(self.slant_of_line.len() / 2)?;
        self.instruments.get(slant)
    }
}

/// Consecutive slants over which the coherence radius of the whole path changes by at most 2 %.
fn groups(scene: &Scene, slants: &[Slant]) -> Result<Vec<Vec<Slant>>, Error> {
    let mut groups: Vec<Vec<Slant>> = Vec::new();
    let mut range_of_group = [f64::NAN; 2];
    for slant in slants {
        let radius_m = coherence_radius_m(scene, *slant)?;
        let [least_m, largest_m] = range_of_group;
        let wider = [least_m.min(radius_m), largest_m.max(radius_m)];
        match groups.last_mut() {
            Some(group) if wider[1] <= SIMILAR * wider[0] => {
                group.push(*slant);
                range_of_group = wider;
            }
            _ => {
                groups.push(vec![*slant]);
                range_of_group = [radius_m; 2];
            }
        }
    }
    Ok(groups)
}

/// Coherence radius of a spherical wave from the end of the scan, m; 1 without turbulence.
fn coherence_radius_m(scene: &Scene, [height_m, elevation_rad]: Slant) -> Result<f64, Error> {
    let Some(t) = scene.refractive_turbulence() else {
        return Ok(1.0);
    };
    let path = t.cn2_along(height_m, elevation_rad);
    let wavelength_m = scene.laser.wavelength_m;
    let range_m = scene.scan.range_max_m;
    Ok(optics::air::coherence_radius_m(
        &path,
        wavelength_m,
        range_m,
    )?)
}

impl Plan {
    /// The instrument with the air of each slant of the scan: one, unless the air changes with height.
    pub(crate) fn instruments(&self) -> &[Instrument] {
        match self.layered_air.instruments.as_slice() {
            [] => std::slice::from_ref(&self.instrument),
            all => all,
        }
    }

    /// Which of [`Self::instruments`] a line has.
    pub(crate) fn air_of_line(&self, line: usize) -> usize {
        self.layered_air
            .slant_of_line
            .get(line)
            .copied()
            .unwrap_or(0)
    }

    /// Which group of equal turbulence a line belongs to.
    pub(crate) fn turbulence_of_line(&self, line: usize) -> usize {
        let air = self.air_of_line(line);
        self.layered_air
            .group_of_slant
            .get(air)
            .copied()
            .unwrap_or(0)
    }

    /// One instrument of each group of equal turbulence.
    pub(crate) fn turbulences(&self) -> Vec<&Instrument> {
        let all = self.instruments();
        let groups = &self.layered_air.group_of_slant;
        let mut firsts = vec![&all[0]];
        for i in 1..groups.len() {
            if groups[i] != groups[i - 1] {
                firsts.push(&all[i]);
            }
        }
        firsts
    }

    /// The line whose air [`Self::instrument`] has.
    pub(crate) fn reference_line(&self) -> usize {
        self.layered_air.slant_of_line.len() / 2
    }

    /// Elevation of that line, rad; none where the air does not change with height.
    pub(crate) fn air_elevation_rad(&self) -> Option<f64> {
        let is_layered = self.scene().has_layered_air();
        is_layered.then(|| self.geometry.elevation_rad[self.reference_line()])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::Target;
    use crate::scene::SceneFile;
    use std::path::Path;

    fn plan(atmosphere: &str) -> Plan {
        let text = format!("[scan]\nlidar_height_m = 2.0\n{atmosphere}");
        let file = SceneFile::parse(&text, Path::new("s.toml")).unwrap();
        Plan::without_stages(file, Target::Map).unwrap()
    }

    #[test]
    fn elevations_of_a_group_have_coherence_radii_within_2_percent() {
        let plan = plan(
            "[telescope]\nreceiver = \"bistatic\"\n[atmosphere.turbulence]\nkind = \"refractive\"\n\
             profile = { kind = \"hufnagel_valley\" }\n",
        );
        let scene = plan.scene();
        let lines = plan.geometry.elevation_rad.len();
        let groups = plan.turbulences().len();
        assert!((2..lines / 4).contains(&groups), "{groups} of {lines}");
        for line in 0..lines {
            let own_m = coherence_radius_m(scene, [2.0, plan.geometry.elevation_rad[line]]);
            let instrument = &plan.instruments()[plan.air_of_line(line)];
            let cn2 = &instrument.turbulence.as_ref().unwrap().cn2;
            let range_m = scene.scan.range_max_m;
            let of_group_m = optics::air::coherence_radius_m(cn2, 1.55e-6, range_m);
            let ratio = own_m.unwrap() / of_group_m.unwrap();
            assert!((ratio - 1.0).abs() <= SIMILAR - 1.0, "{line}: {ratio}");
        }
    }

    #[test]
    fn each_line_has_the_aerosol_of_its_heights() {
        let plan =
            plan("[atmosphere]\naerosol = { kind = \"layer\", top_m = 60.0, step_m = 10.0 }\n");
        for (line, elevation_rad) in plan.geometry.elevation_rad.iter().enumerate() {
            let height_m = 2.0 + 400.0 * elevation_rad.sin();
            let step = 0.5 * (1.0 + ((height_m - 60.0) / 10.0).tanh());
            let below = 2e-6 * (-height_m / 3000.0).exp() * (1.0 - step);
            let expected = below + 5e-8 * (-(height_m - 60.0).max(0.0) / 2000.0).exp() * step;
            let air = &plan.instruments()[plan.air_of_line(line)].air;
            let found = air.backscatter_per_m_sr(400.0).unwrap();
            assert!((found / expected - 1.0).abs() < 1e-5, "{line}: {found:e}");
        }
        assert_eq!(plan.turbulences().len(), 1);
    }

    #[test]
    fn lines_share_one_air_that_does_not_change_with_height() {
        let plan = plan("[atmosphere]\naerosol = { kind = \"visibility\" }\n");
        assert_eq!(plan.instruments().len(), 1);
        let alpha_per_m = -plan.instrument.air.transmission(1000.0).unwrap().ln() / 1000.0;
        let backscatter = plan.instrument.air.backscatter_per_m_sr(500.0).unwrap();
        assert!(
            (alpha_per_m / 4.422_942_56e-5 - 1.0).abs() < 1e-8,
            "{alpha_per_m:e}"
        );
        assert!((alpha_per_m / backscatter - 40.0).abs() < 1e-9);
    }
}
