//! The cheapest model of the efficiency that is valid for a scene, and at which ranges it is computed.
//!
//! Free space is a quadrature. Turbulence on independent paths (bistatic) has an exact mean at any strength.
//! Only turbulence that both beams share (monostatic) needs phase screens.

use crate::plan::geometry::Geometry;
use crate::scene::{EfficiencyOfPulse, RefractiveTurbulence, Scene, SnrReference};
use wakescope_optics::Cn2Path;
use wakescope_optics::plan::{Model, cheapest_model};

/// The cheapest model of the efficiency that is valid for a scene.
pub(crate) fn model(scene: &Scene) -> Model {
    let cn2 = match scene.refractive_turbulence() {
        None => Cn2Path::None,
        Some(t) => t.cn2_along(0.0, 0.0),
    };
    cheapest_model(scene.telescope.receiver, &cn2)
}

/// The turbulence of a scene whose pulses each have the efficiency of one realisation.
pub(crate) fn drawn_turbulence(scene: &Scene) -> Option<RefractiveTurbulence> {
    scene
        .refractive_turbulence()
        .filter(|t| t.efficiency == EfficiencyOfPulse::Realisation)
}

/// How close the ranges of quadratures are where there are more: what is joined between them is within 0.005 dB.
pub(crate) const OF_QUADRATURES: f64 = 12.0;
/// Most ranges at which a quadrature is done for each.
pub(crate) const MOST_QUADRATURES: usize = 256;
/// How close those of phase screens are: ratios to theory bend less.
pub(crate) const OF_SCREENS: f64 = 1.0;

/// Whether the signals take their efficiency from phase screens.
pub(crate) fn signals_cross_screens(scene: &Scene) -> bool {
    let of_signals = model(scene) == Model::MonteCarlo || drawn_turbulence(scene).is_some();
    of_signals && !matches!(scene.detector.snr, SnrReference::Fixed { .. })
}

/// The stretches with phase screens of their own in which there are some of these ranges, m, increasing, with those ranges: the
/// air of the signals, and what of the profile lies before it and behind it.
pub(crate) fn stretches<'a>(
    scene: &Scene,
    g: &Geometry,
    mut range_m: &'a [f64],
) -> Vec<([f64; 2], &'a [f64])> {
    let o = &scene.outputs;
    let [first_m, last_m] = [o.profile_range_min_m, o.profile_range_max_m];
    let near_m = g.first_layer_range_m;
    let far_m = g.first_layer_range_m + g.layers as f64 * g.layer_thickness_m;
    let all = match signals_cross_screens(scene) {
        true => {
            vec![
                [first_m, near_m.next_down().min(last_m)],
                [near_m, far_m],
                [far_m.next_up().max(first_m), last_m],
            ]
        }
        false => vec![[first_m, last_m]],
    };
    let mut out = Vec::new();
    // The profile need not reach beyond the signals.
    for [from_m, to_m] in all.into_iter().filter(|[from_m, to_m]| from_m <= to_m) {
        range_m = &range_m[range_m.partition_point(|r| *r < from_m)..];
        let (inside, beyond) = range_m.split_at(range_m.partition_point(|r| *r <= to_m));
        if !inside.is_empty() {
            out.push(([from_m, to_m], inside));
        }
        range_m = beyond;
    }
    out
}
