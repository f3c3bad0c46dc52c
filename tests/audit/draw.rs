//! Random scenes over all keys, small enough to run in about a second.

use super::draw_air::{atmosphere, flow};
use super::random::Random;
use super::scene::Scene;

/// A vertical scan of a random air with a random instrument and estimator.
pub(crate) fn scene(r: &mut Random) -> Scene {
    let mut s = Scene::default();
    s.set("seed", r.whole(1, 1_000_000));
    s.set("outputs.svg", false)
        .set("outputs.png", false)
        .set("outputs.flow", false);
    s.set("outputs.profile_points", r.whole(2, 9));
    instrument(r, &mut s);
    pulse(r, &mut s);
    detector(r, &mut s);
    atmosphere(r, &mut s);
    flow(r, &mut s);
    scan(r, &mut s);
    estimator(r, &mut s);
    s
}

pub(crate) fn instrument(r: &mut Random, s: &mut Scene) {
    s.number("laser.wavelength_m", r.pick(&[1.55e-6, 1.55e-6, 2.02e-6]))
        .number("laser.pulse_repetition_hz", r.log(200.0, 20e3));
    s.number("pulse.energy_j", r.log(2e-5, 5e-3));
    let aperture_m = r.log(0.02, 0.12);
    s.number("telescope.aperture_radius_m", aperture_m);
    s.number("telescope.beam_radius_m", aperture_m * r.between(0.4, 1.2));
    s.word(
        "telescope.beam_radius_definition",
        r.pick(&["intensity", "field"]),
    );
    s.word("telescope.receiver", r.pick(&["monostatic", "bistatic"]));
    if r.chance(0.2) {
        s.number(
            "telescope.obscuration_radius_m",
            aperture_m * r.between(0.05, 0.4),
        );
    }
    if r.chance(0.6) {
        s.number("telescope.focus_m", r.log(250.0, 3000.0));
    } else if r.chance(0.2) {
        s.number("telescope.focus_m", -r.log(500.0, 3000.0));
    }
    if r.chance(0.3) {
        s.number("telescope.optics_loss_db", r.between(0.0, 6.0));
    }
}

fn pulse(r: &mut Random, s: &mut Scene) {
    s.number("pulse.shape.duration_s", r.log(8e-8, 5e-7));
    s.word(
        "pulse.shape.definition",
        r.pick(&["fwhm", "one_over_e_half_width"]),
    );
}

pub(crate) fn detector(r: &mut Random, s: &mut Scene) {
    s.word("detector.noise", r.pick(&["band", "band", "white"]));
    s.number("detector.quantum_efficiency", r.between(0.3, 1.0))
        .number("detector.local_oscillator_w", r.log(1e-4, 1e-2));
    let (sampling_hz, bandwidth_hz) =
        r.pick(&[(250e6, 50e6), (200e6, 60e6), (400e6, 80e6), (125e6, 40e6)]);
    s.number("detector.sampling_hz", sampling_hz)
        .number("detector.bandwidth_hz", bandwidth_hz);
    let lowest_hz = 0.52 * bandwidth_hz;
    s.number(
        "detector.intermediate_frequency_hz",
        r.between(lowest_hz, 0.5 * sampling_hz - lowest_hz),
    );
    if r.chance(0.3) {
        s.word("detector.signal", "baseband");
    }
    match r.whole(0, 5) {
        0 => s.word("detector.snr.reference", "chapter"),
        1 | 2 => s
            .word("detector.snr.reference", "fixed")
            .number("detector.snr.snr_db", r.between(-8.0, 20.0)),
        _ => {
            if r.chance(0.4) {
                front_end(r, s);
            }
            s.word("detector.snr.reference", "physical")
        }
    };
    if s.s("detector.snr.reference") == "fixed" {
        s.unset("telescope.optics_loss_db");
    } else if r.chance(0.15) && s.s("detector.signal") != "baseband" {
        s.word("detector.digitiser.kind", "quantised")
            .set("detector.digitiser.bits", r.whole(6, 14));
        s.number(
            "detector.digitiser.full_scale_over_noise",
            r.between(14.0, 30.0),
        );
    }
}

/// The same ratio at every range, and no loss that would change it.
pub(crate) fn fixed_ratio(s: &mut Scene, snr_db: f64) {
    s.unset("detector.front_end")
        .unset("detector.digitiser")
        .unset("detector.snr");
    s.unset("telescope.optics_loss_db");
    s.word("detector.snr.reference", "fixed")
        .number("detector.snr.snr_db", snr_db);
}

fn front_end(r: &mut Random, s: &mut Scene) {
    if r.chance(0.5) {
        s.number(
            "detector.front_end.amplifier_noise_a_rthz",
            r.log(1e-12, 3e-11),
        );
    }
    if r.chance(0.5) {
        s.number("detector.front_end.load_ohm", r.log(30.0, 1e4))
            .number(
                "detector.front_end.load_temperature_k",
                r.between(200.0, 320.0),
            );
    }
    if r.chance(0.5) {
        s.number("detector.front_end.dark_current_a", r.log(1e-9, 1e-4));
    }
    if r.chance(0.5) {
        s.number(
            "detector.front_end.intensity_noise_db_hz",
            r.between(-170.0, -150.0),
        )
        .number("detector.front_end.rejection_db", r.between(0.0, 30.0));
    }
    if r.chance(0.4) {
        s.number("detector.front_end.saturation_w", r.log(1e-3, 1e-1));
    }
    if r.chance(0.4) {
        s.number("detector.front_end.half_power_hz", r.log(5e7, 5e8))
            .set("detector.front_end.poles", r.whole(1, 4));
    }
}

fn scan(r: &mut Random, s: &mut Scene) {
    let (first, step) = (r.between(0.06, 0.11), r.pick(&[1.25e-3, 2.5e-3, 5e-3]));
    s.number("scan.elevation_min_rad", first)
        .number("scan.elevation_step_rad", step);
    s.number(
        "scan.elevation_max_rad",
        first + step * (r.whole(2, 14) as f64 + 0.3),
    );
    s.number("scan.range_min_m", r.between(250.0, 340.0))
        .number("scan.range_max_m", r.between(430.0, 520.0));
    s.set("scan.pulses_per_line", r.whole(1, 5))
        .set("scan.realisations", r.whole(1, 5));
    if r.chance(0.5) {
        s.number("scan.lidar_height_m", r.between(0.0, 10.0));
    }
    if r.chance(0.2) {
        s.number("scan.azimuth_rad", r.between(0.0, 6.0));
    }
    if r.chance(0.3) {
        s.number("site.latitude_deg", r.between(-60.0, 60.0))
            .number("site.longitude_deg", r.between(-170.0, 170.0));
        s.number("site.altitude_m", r.between(0.0, 500.0));
    }
}

fn estimator(r: &mut Random, s: &mut Scene) {
    let method = r.pick(&[
        "periodogram_accumulation",
        "periodogram_accumulation",
        "periodogram",
        "autoregressive",
        "pulse_pair",
        "first_moment",
        "likelihood",
    ]);
    s.set(
        "estimator.window_samples",
        r.pick(&[16, 24, 32, 48, 64, 96]),
    )
    .set("estimator.window_step_samples", r.whole(1, 4));
    s.set("estimator.gate_step_samples", r.pick(&[5, 8, 12, 20]))
        .set("estimator.padded_samples", r.pick(&[256, 512, 1024]));
    let weighting = r.pick(&["gaussian", "rectangular", "hann"]);
    // The likelihood has tapers of its own.
    s.word(
        "estimator.weighting",
        if method == "likelihood" {
            "gaussian"
        } else {
            weighting
        },
    );
    s.word("estimator.method.kind", method)
        .number("estimator.false_alarm", r.pick(&[0.01, 0.0, 0.1]));
    if method == "autoregressive" {
        s.set("estimator.method.order", r.whole(2, 15));
    }
    if method == "pulse_pair" {
        s.unset("estimator.padded_samples");
    }
    if method != "periodogram" {
        match r.chance(0.8) {
            true => s.number("estimator.radius_m", r.between(0.0, 5.0)),
            false => s
                .word("estimator.radius.kind", "of_range")
                .set("estimator.radius.range_m", "[300.0, 450.0]")
                .set(
                    "estimator.radius.radius_m",
                    format!("[{:?}, {:?}]", r.between(1.0, 3.0), r.between(2.0, 6.0)),
                ),
        };
    }
}
