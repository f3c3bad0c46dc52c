//! Colours: a palette for curves that colour-blind readers can distinguish (Okabe and Ito 2008), and two colour maps computed in
//! OKLab (Ottosson 2020), in which equal steps look equal.
//! Check: the diverging map is symmetric in lightness about zero, the sequential one darkens steadily.

/// Red, green, blue, 0 to 255.
pub type Rgb = [u8; 3];

/// Drawn where a value is missing.
pub const MISSING: Rgb = [178, 178, 178];

const PALETTE: [Rgb; 7] = [
    [0, 114, 178],
    [213, 94, 0],
    [0, 158, 115],
    [204, 121, 167],
    [230, 159, 0],
    [86, 180, 233],
    [40, 40, 40],
];

/// Colour of curve `index`; repeats after seven.
pub fn curve_colour(index: usize) -> Rgb {
    PALETTE[index % PALETTE.len()]
}

/// How a value becomes a colour.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ColourMap {
    /// Blue below zero, near-white at zero, red above, symmetric; saturates at +- `limit`.
    Diverging {
        /// Value of the last colour, in the unit of the field; positive.
        limit: f64,
    },
    /// Light to dark between two values.
    Sequential {
        /// Value of the lightest colour.
        low: f64,
        /// Value of the darkest colour.
        high: f64,
    },
}

impl ColourMap {
    /// Smallest and largest value of the colour bar.
    pub fn range(&self) -> (f64, f64) {
        match *self {
            Self::Diverging { limit } => (-limit, limit),
            Self::Sequential { low, high } => (low, high),
        }
    }

    /// Colour of a value; [`MISSING`] for NaN, the end colours beyond the range.
    pub fn colour(&self, value: f64) -> Rgb {
        if value.is_nan() {
            return MISSING;
        }
        let (low, high) = self.range();
        let place = ((value - low) / (high - low)).clamp(0.0, 1.0);
        match self {
            Self::Diverging { .. } => diverging(2.0 * place - 1.0),
            Self::Sequential { .. } => sequential(place),
        }
    }
}

/// s in -1 .. 1: one curve of lightness and chroma for both signs, only the hue differs.
fn diverging(s: f64) -> Rgb {
    let strength = s.abs();
    let hue_deg: f64 = if s < 0.0 { 250.0 } else { 32.0 };
    let lightness = 0.97 - 0.55 * strength.powf(1.1);
    // Chroma rises fast from the white centre and falls a little at the dark end, where screens have none to give.
    let chroma = 0.15 * (1.0 - (1.0 - strength).powi(2)) - 0.02 * strength;
    from_oklch(lightness, chroma, hue_deg)
}

/// t in 0 .. 1, light to dark, yellow over green to blue.
fn sequential(t: f64) -> Rgb {
    // Below what screens can show along the whole path (0.095 at t = 0.65): a cut would make the steps uneven.
    let chroma = 0.07 + 0.03 * t;
    from_oklch(0.96 - 0.66 * t, chroma, 105.0 + 175.0 * t)
}

fn from_oklch(lightness: f64, chroma: f64, hue_deg: f64) -> Rgb {
    let hue = hue_deg.to_radians();
    let a = chroma * hue.cos();
    let b = chroma * hue.sin();
    let l = (lightness + 0.396_337_777_4 * a + 0.215_803_757_3 * b).powi(3);
    let m = (lightness - 0.105_561_345_8 * a - 0.063_854_172_8 * b).powi(3);
    let s = (lightness - 0.089_484_177_5 * a - 1.291_485_548_0 * b).powi(3);
    let linear = [
        4.076_741_662_1 * l - 3.307_711_591_3 * m + 0.230_969_929_2 * s,
        -1.268_438_004_6 * l + 2.609_757_401_1 * m - 0.341_319_396_5 * s,
        -0.004_196_086_3 * l - 0.703_418_614_7 * m + 1.707_614_701_0 * s,
    ];
    linear.map(|c| {
        let c = c.clamp(0.0, 1.0);
        let gamma = if c <= 0.003_130_8 {
            12.92 * c
        } else {
            1.055 * c.powf(1.0 / 2.4) - 0.055
        };
        (255.0 * gamma).round() as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Relative luminance of sRGB (IEC 61966-2-1).
    fn luminance(rgb: Rgb) -> f64 {
        let linear = rgb.map(|c| {
            let c = f64::from(c) / 255.0;
            if c <= 0.04045 {
                c / 12.92
            } else {
                ((c + 0.055) / 1.055).powf(2.4)
            }
        });
        0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]
    }

    #[test]
    fn the_diverging_map_is_symmetric_and_blue_is_negative() {
        let map = ColourMap::Diverging { limit: 8.0 };
        for v in [0.5, 2.0, 4.0, 8.0] {
            let down = map.colour(-v);
            let up = map.colour(v);
            assert!(down[2] > down[0] && up[0] > up[2], "{v}: {down:?} {up:?}");
            let ratio = (luminance(down) + 0.05) / (luminance(up) + 0.05);
            assert!(
                (0.75..1.33).contains(&ratio),
                "{v}: {down:?} {up:?} {ratio}"
            );
        }
        let zero = map.colour(0.0);
        let spread = zero.iter().max().unwrap() - zero.iter().min().unwrap();
        assert!(zero[0] > 240 && spread <= 2, "{zero:?}");
        assert_eq!(map.colour(-0.0), zero);
        assert_eq!(map.colour(80.0), map.colour(8.0));
    }

    #[test]
    fn both_maps_darken_steadily() {
        let sequential = ColourMap::Sequential {
            low: 0.0,
            high: 1.0,
        };
        let diverging = ColourMap::Diverging { limit: 1.0 };
        for map in [sequential, diverging] {
            let path: Vec<f64> = (0..=50)
                .map(|i| luminance(map.colour(f64::from(i) / 50.0)))
                .collect();
            assert!(
                path.windows(2).all(|w| w[1] < w[0] + 1e-3),
                "{map:?} {path:?}"
            );
            assert!(
                path[0] > 0.8 && path[50] < 0.2,
                "{map:?} {} {}",
                path[0],
                path[50]
            );
        }
    }

    #[test]
    fn equal_steps_look_about_equal() {
        for map in [
            ColourMap::Sequential {
                low: 0.0,
                high: 1.0,
            },
            ColourMap::Diverging { limit: 1.0 },
        ] {
            let colours: Vec<Rgb> = (0..=20)
                .map(|i| {
                    map.colour(
                        map.range().0 + f64::from(i) / 20.0 * (map.range().1 - map.range().0),
                    )
                })
                .collect();
            let steps: Vec<f64> = colours
                .windows(2)
                .map(|w| {
                    w[0].iter()
                        .zip(w[1])
                        .map(|(a, b)| (f64::from(*a) - f64::from(b)).powi(2))
                        .sum::<f64>()
                        .sqrt()
                })
                .collect();
            let (least, most) = steps
                .iter()
                .fold((f64::MAX, 0.0_f64), |r, s| (r.0.min(*s), r.1.max(*s)));
            assert!(least > 0.0 && most < 2.5 * least, "{map:?} {steps:?}");
        }
    }

    #[test]
    fn missing_is_grey() {
        assert_eq!(
            ColourMap::Diverging { limit: 1.0 }.colour(f64::NAN),
            MISSING
        );
    }
}
