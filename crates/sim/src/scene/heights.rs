//! Aerosol and refractive turbulence over height.
//!
//! Check: haze and layer give the budget other values along slanted lines; fog and tables out of order are refused.

use crate::keys::{Checker, Number, keys};
use wakescope_optics::Cn2Path;
use wakescope_optics::air::hufnagel_valley_m_m23;
use wakescope_signal::{self as signal, Medium, aerosol};

/// Visibilities of haze.
const VISIBILITY: Number = Number(
    |value| (aerosol::LEAST_VISIBILITY_M..=1e6).contains(&value),
    "from 1000 to 1e6 {}: fog is not modelled",
);

keys! {
    /// Aerosol from a visibility or over height, in place of one backscatter and extinction.
    #[derive(Copy)]
    kinds Aerosol by "kind" {
        /// Haze of a visibility, the same at all heights (Kruse; Kim 2001).
        "visibility" => Visibility {
            /// Meteorological visibility, m.
            visibility_m: f64 = 23e3 => VISIBILITY,
            /// Extinction over backscatter, sr.
            lidar_ratio_sr: f64 = 40.0 => 1.0..=1e3,
        },
        /// A boundary layer with a step at its top.
        "layer" => Layer(LayeredAerosol),
    }

    /// Aerosol of a boundary layer: exponential in height below its top and above it.
    #[derive(Copy)]
    table LayeredAerosol {
        /// Backscatter coefficient at the ground, 1/(m sr).
        ground_backscatter_per_m_sr: f64 = 2e-6 => 0.0..=1.0,
        /// Height over which it falls by e within the layer, m.
        scale_height_m: f64 = 3000.0 => 100.0..=1e6,
        /// Height of the top of the layer, m.
        top_m: f64 = 900.0 => 1.0..=2e4,
        /// Backscatter coefficient above the top, 1/(m sr); it falls by e over 2000 m.
        above_backscatter_per_m_sr: f64 = 5e-8 => 0.0..=1.0,
        /// Half width of the step at the top, m.
        step_m: f64 = 60.0 => 1.0..=2e3,
        /// Extinction over backscatter, sr.
        lidar_ratio_sr: f64 = 40.0 => 1.0..=1e3,
    }

    /// Cn2 over height, in place of one value.
    kinds Cn2Profile by "kind" {
        /// The Hufnagel-Valley model; its defaults are those of 5/7.
        "hufnagel_valley" => HufnagelValley {
            /// Wind at high altitude, m/s.
            high_wind_m_s: f64 = 21.0 => 0.0..=200.0,
            /// Cn2 of the surface term at the ground, m^(-2/3).
            ground_cn2_m_m23: f64 = 1.7e-14 => 0.0..=1e-9,
        },
        /// Values between which Cn2 is linear; constant below and above them.
        "table" => Table(Cn2Table),
    }

    /// Cn2 at some heights.
    table Cn2Table {
        /// Heights above ground, m, increasing.
        heights_m: Vec<f64> = Vec::new() => 0.0..=1e5,
        /// Cn2 at each, m^(-2/3).
        values_m_m23: Vec<f64> = Vec::new() => 0.0..=1e-9,
    }
}

impl Aerosol {
    /// The aerosol at a wavelength: over height for a layer, else uniform.
    ///
    /// # Errors
    /// What the laws refuse; a checked scene gives none.
    pub(super) fn medium(&self, wavelength_m: f64) -> Result<Medium, signal::Error> {
        match self {
            Self::Visibility {
                visibility_m,
                lidar_ratio_sr,
            } => {
                let extinction_per_m =
                    aerosol::extinction_of_visibility_per_m(*visibility_m, wavelength_m)?;
                Medium::uniform(extinction_per_m / lidar_ratio_sr, extinction_per_m)
            }
            Self::Layer(layer) => aerosol::AerosolLayer {
                ground_per_m_sr: layer.ground_backscatter_per_m_sr,
                scale_height_m: layer.scale_height_m,
                top_m: layer.top_m,
                above_per_m_sr: layer.above_backscatter_per_m_sr,
                step_m: layer.step_m,
            }
            .over_height(layer.lidar_ratio_sr),
        }
    }

    /// Whether the aerosol changes with height.
    pub(super) fn is_layered(&self) -> bool {
        matches!(self, Self::Layer(_))
    }
}

impl Cn2Profile {
    /// Cn2 along a line of sight from a height, m, with an elevation, rad.
    pub(super) fn along(&self, telescope_height_m: f64, elevation_rad: f64) -> Cn2Path {
        match self {
            Self::HufnagelValley {
                high_wind_m_s,
                ground_cn2_m_m23,
            } => {
                let law = |height_m: f64| {
                    hufnagel_valley_m_m23(height_m, *high_wind_m_s, *ground_cn2_m_m23)
                };
                Cn2Path::from_law(law, telescope_height_m, elevation_rad)
            }
            // Constant beyond the ends.
            Self::Table(table) => Cn2Path::Heights {
                height_m: table.heights_m.clone(),
                cn2_m_m23: table.values_m_m23.clone(),
                telescope_height_m,
                elevation_rad,
            },
        }
    }

    /// Refuses a table at `at` with fewer than two heights, not one value each, or heights that do not increase; whether it is good.
    pub(super) fn check(&self, at: &str, c: &mut Checker<'_>) -> bool {
        let Self::Table(table) = self else {
            return true;
        };
        let count = table.heights_m.len();
        let heights = format!("{at}.heights_m");
        if !c.require(
            count >= 2,
            &heights,
            &table.heights_m,
            "at least two heights",
        ) {
            return false;
        }
        let values = format!("{at}.values_m_m23");
        let allowed = format!("one value for each of the {count} heights");
        let is_whole = table.values_m_m23.len() == count;
        if !c.require(is_whole, &values, &table.values_m_m23, allowed) {
            return false;
        }
        for i in 1..count {
            let before_m = table.heights_m[i - 1];
            let height_m = table.heights_m[i];
            let allowed = format!("above the height before it, {before_m} m");
            if !c.require(
                height_m > before_m,
                &format!("{heights}[{i}]"),
                height_m,
                allowed,
            ) {
                return false;
            }
        }
        true
    }

    /// Height at which a table ends, m; none for a law.
    pub(crate) fn end_m(&self) -> Option<f64> {
        match self {
            Self::HufnagelValley { .. } => None,
            Self::Table(table) => table.heights_m.last().copied(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cn2_below_the_lowest_and_above_the_highest_height_is_that_of_the_end() {
        let table = Cn2Profile::Table(Cn2Table {
            heights_m: vec![5.0, 50.0],
            values_m_m23: vec![4e-14, 1e-14],
        });
        let law = Cn2Profile::HufnagelValley {
            high_wind_m_s: 21.0,
            ground_cn2_m_m23: 1.7e-14,
        };
        // To 100 m below the lidar and as far above it.
        let slope_rad = 0.5_f64.asin();
        let ground = hufnagel_valley_m_m23(0.0, 21.0, 1.7e-14);
        for (profile, elevation_rad, expected) in [
            (&table, -slope_rad, 4e-14),
            (&table, slope_rad, 1e-14),
            (&law, -slope_rad, ground),
        ] {
            let found = profile.along(20.0, elevation_rad).at(200.0);
            assert_eq!(found.unwrap(), expected, "{elevation_rad}");
        }
    }
}
