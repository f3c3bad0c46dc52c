//! A receiver beyond shot noise: closed forms against stored tables of independent origin.

use approx::assert_relative_eq;
use wakescope_signal::receiver::echoes::ambiguous_range_m;
use wakescope_signal::receiver::phase_noise::{mean_frequency_sd_m_s, peak_variance_factor};
use wakescope_signal::receiver::{Clipping, Converter, FrontEnd};
use wakescope_signal::{Error, GaussianPulse, Pulse, Receiver, SPEED_OF_LIGHT_M_S};

/// The rows of a stored table.
fn rows<const N: usize>(name: &str) -> Vec<[f64; N]> {
    let path = format!(
        "{}/../../tests/reference/receiver/{name}.csv",
        env!("CARGO_MANIFEST_DIR")
    );
    let text = std::fs::read_to_string(path).unwrap();
    let rows: Vec<[f64; N]> = text
        .lines()
        .filter(|line| line.starts_with(|c: char| c.is_ascii_digit()))
        .map(|line| {
            line.split(',')
                .map(|x| x.parse().unwrap())
                .collect::<Vec<f64>>()
                .try_into()
                .unwrap()
        })
        .collect();
    assert!(rows.len() >= 4, "{name}: {} rows", rows.len());
    rows
}

fn close(found: f64, expected: f64) {
    approx::assert_relative_eq!(found, expected, max_relative = 1e-6, epsilon = 1e-12);
}

/// What noise beside that of so much power costs \[dB\].
fn excess_db(ratio: f64) -> f64 {
    10.0 * (1.0 + ratio).log10()
}

fn with(front_end: FrontEnd) -> Receiver {
    Receiver {
        front_end,
        ..Receiver::table2()
    }
}

#[test]
fn noise_densities_and_what_they_cost_are_the_stored_ones() {
    for [
        wavelength_m,
        quantum_efficiency,
        local_oscillator_w,
        rin,
        rejection_db,
        amplifier,
        dark,
        expected @ ..,
    ] in rows::<16>("noise_density")
    {
        let front_end = FrontEnd {
            intensity_noise_db_hz: rin,
            rejection_db,
            amplifier_noise_a_rthz: amplifier,
            dark_current_a: dark,
            ..FrontEnd::IDEAL
        };
        let receiver = Receiver {
            wavelength_m,
            quantum_efficiency,
            local_oscillator_w,
            front_end,
            ..Receiver::table2()
        };
        let n = receiver.noise_densities();
        let found = [
            receiver.responsivity_a_w(),
            n.shot_a2_hz,
            n.amplifier_a2_hz,
            n.dark_a2_hz,
            n.intensity_a2_hz,
            excess_db(n.amplifier_a2_hz / n.shot_a2_hz),
            excess_db(n.dark_a2_hz / n.shot_a2_hz),
            excess_db(n.intensity_a2_hz / n.shot_a2_hz),
            receiver.penalties().total_db(),
        ];
        found
            .iter()
            .zip(expected)
            .for_each(|(found, expected)| close(*found, expected));
        assert_relative_eq!(
            receiver.noise_density_a2_hz(),
            n.shot_a2_hz * 10f64.powf(0.1 * expected[8]),
            max_relative = 1e-9
        );
    }
    // 50 ohm at 290 K, 2.55 dB beside the shot noise of 1 mW.
    let thermal = with(FrontEnd {
        load_ohm: 50.0,
        ..FrontEnd::IDEAL
    });
    assert_relative_eq!(
        thermal.noise_densities().amplifier_a2_hz,
        3.203e-22,
        max_relative = 1e-4
    );
    assert!((thermal.penalties().total_db() - 2.55).abs() < 0.005);
}

#[test]
fn noises_equal_shot_noise_at_powers_that_saturation_raises_or_removes() {
    let front_end = FrontEnd {
        amplifier_noise_a_rthz: 10e-12,
        load_ohm: 200.0,
        load_temperature_k: 310.0,
        intensity_noise_db_hz: -150.0,
        rejection_db: 20.0,
        saturation_w: 5e-3,
        ..FrontEnd::IDEAL
    };
    for local_oscillator_w in [1e-4, 2e-3, 0.1] {
        let receiver = |front_end: FrontEnd| Receiver {
            wavelength_m: 2.05e-6,
            quantum_efficiency: 0.7,
            local_oscillator_w,
            ..with(front_end)
        };
        // 500.44 uW = P/(1 + P/P_s), and 27.686 mW = P/(1 + P/P_s)^3, which is at most 4 P_s/27.
        let saturated = receiver(front_end);
        assert_relative_eq!(
            saturated.amplifier_equals_shot_w(),
            556.10e-6,
            max_relative = 1e-5
        );
        assert_eq!(saturated.intensity_equals_shot_w(), f64::INFINITY);
        let free = receiver(FrontEnd {
            saturation_w: f64::INFINITY,
            ..front_end
        });
        assert_relative_eq!(
            free.amplifier_equals_shot_w(),
            500.44e-6,
            max_relative = 1e-5
        );
        assert_relative_eq!(
            free.intensity_equals_shot_w(),
            27.6857e-3,
            max_relative = 1e-5
        );
        let low = receiver(FrontEnd {
            saturation_w: 0.4e-3,
            ..front_end
        });
        assert_eq!(low.amplifier_equals_shot_w(), f64::INFINITY);
        let high = receiver(FrontEnd {
            saturation_w: 1.0,
            ..front_end
        });
        let equal_w = high.intensity_equals_shot_w();
        let noises = Receiver {
            local_oscillator_w: equal_w,
            ..high
        }
        .noise_densities();
        assert!(equal_w > 27.7e-3 && equal_w < 0.5, "{equal_w}");
        assert_relative_eq!(
            noises.intensity_a2_hz,
            noises.shot_a2_hz,
            max_relative = 1e-9
        );
    }
    assert_eq!(
        with(FrontEnd::IDEAL).intensity_equals_shot_w(),
        f64::INFINITY
    );
    assert_eq!(with(FrontEnd::IDEAL).amplifier_equals_shot_w(), 0.0);
}

#[test]
fn saturation_costs_what_is_stored_and_its_best_local_oscillator_is_the_best() {
    for [
        local_oscillator_w,
        saturation_w,
        amplifier,
        loss,
        shot_limited,
        best_w,
        best_loss,
    ] in rows::<7>("lo_saturation")
    {
        let front_end = FrontEnd {
            saturation_w,
            amplifier_noise_a_rthz: amplifier,
            ..FrontEnd::IDEAL
        };
        let receiver = Receiver {
            local_oscillator_w,
            ..with(front_end)
        };
        close(receiver.penalties().total_db(), loss);
        close(receiver.penalties().saturation_db, shot_limited);
        close(receiver.best_local_oscillator_w(), best_w);
        if best_w > 0.0 {
            let at = |local_oscillator_w| {
                Receiver {
                    local_oscillator_w,
                    ..receiver
                }
                .penalties()
                .total_db()
            };
            close(at(best_w), best_loss);
            let noisy = with(FrontEnd {
                intensity_noise_db_hz: -150.0,
                rejection_db: 10.0,
                dark_current_a: 1e-6,
                ..front_end
            });
            let best_w = noisy.best_local_oscillator_w();
            let at = |local_oscillator_w| {
                Receiver {
                    local_oscillator_w,
                    ..noisy
                }
                .penalties()
                .total_db()
            };
            assert!(at(best_w) < at(0.99 * best_w) && at(best_w) < at(1.01 * best_w));
        }
    }
    let free = with(FrontEnd {
        amplifier_noise_a_rthz: 1e-11,
        ..FrontEnd::IDEAL
    });
    assert_eq!(free.best_local_oscillator_w(), f64::INFINITY);
}

#[test]
fn the_poles_of_the_detector_cost_what_is_stored() {
    for [
        order,
        half_power_hz,
        frequency_hz,
        over_shot,
        signal_db,
        against_dc,
        against_shot,
    ] in rows::<7>("band_response")
    {
        let detector = FrontEnd {
            poles: order as u32,
            half_power_hz,
            ..FrontEnd::IDEAL
        };
        let power = detector.power_response_at(frequency_hz);
        close(10.0 * power.log10(), signal_db);
        let shot = with(FrontEnd::IDEAL).noise_density_a2_hz();
        let front_end = FrontEnd {
            amplifier_noise_a_rthz: (over_shot * shot).sqrt(),
            ..detector
        };
        let found = Receiver {
            intermediate_frequency_hz: frequency_hz,
            ..with(front_end)
        };
        close(found.penalties().response_db, against_dc);
        close(found.penalties().total_db(), against_shot);
        let ideal = Receiver {
            intermediate_frequency_hz: frequency_hz,
            ..with(FrontEnd::IDEAL)
        };
        let lost = ideal.slowly_varying_snr(1.0, 1.0) / found.slowly_varying_snr(1.0, 1.0);
        close(10.0 * lost.log10(), against_shot);
    }
}

#[test]
fn rounding_and_clipping_cost_what_is_stored() {
    for [
        bits,
        full_scale_over_noise,
        bandwidth_hz,
        sample_rate_hz,
        expected @ ..,
    ] in rows::<7>("converter_noise")
    {
        let bits = bits as u32;
        let converter = Converter {
            bits,
            full_scale_over_noise,
            bandwidth_hz,
            sample_rate_hz,
            input_over_noise: 1.0,
        };
        let loss_db = with(FrontEnd {
            rounding_noise: converter.rounding(),
            ..FrontEnd::IDEAL
        })
        .penalties()
        .rounding_db;
        let found = [converter.rounding(), loss_db];
        found
            .iter()
            .zip(expected)
            .for_each(|(found, expected)| close(*found, expected));
    }
    for [k, expected @ ..] in rows::<6>("clipping") {
        let c = Clipping::at(k);
        let found = [
            c.clipped_fraction,
            c.gain,
            c.variance,
            c.distortion,
            excess_db(c.distortion / (c.gain * c.gain)),
        ];
        found
            .iter()
            .zip(expected)
            .for_each(|(found, expected)| close(*found, expected));
    }
}

#[test]
fn phase_noise_moves_velocities_as_is_stored() {
    let hann = |s: f64| (std::f64::consts::PI * s).cos().powi(2);
    for [
        samples,
        rate_hz,
        linewidth_hz,
        delay_s,
        mean,
        rectangular,
        of_hann,
    ] in rows::<7>("phase_noise")
    {
        let found = mean_frequency_sd_m_s(1.55e-6, linewidth_hz, delay_s, samples / rate_hz);
        close(found, mean);
        if rectangular.is_finite() {
            close(found * peak_variance_factor(|_| 1.0).sqrt(), rectangular);
            close(found * peak_variance_factor(hann).sqrt(), of_hann);
        }
    }
}

#[test]
fn the_reflex_and_the_pulse_before_are_the_stored_ones() {
    for [
        energy_j,
        fwhm_s,
        bandwidth_hz,
        reflection_db,
        peak_db,
        limit_db,
        time_s,
        range_m,
    ] in rows::<8>("reflex")
    {
        let pulse = Pulse::from(GaussianPulse::of_full_width(fwhm_s, energy_j).unwrap());
        let reflection = 10f64.powf(0.1 * reflection_db);
        let receiver = Receiver {
            bandwidth_hz,
            ..with(FrontEnd {
                reflection,
                ..FrontEnd::IDEAL
            })
        };
        close(10.0 * receiver.reflex_snr(&pulse, 0.0).log10(), peak_db);
        let found_s = receiver.blind_time_s(&pulse, 10f64.powf(0.1 * limit_db));
        close(found_s, time_s);
        close(0.5 * SPEED_OF_LIGHT_M_S * found_s, range_m);
        close(
            10.0 * receiver.reflex_snr(&pulse, found_s).log10(),
            limit_db,
        );
    }
    for [rate_hz, ambiguous_m, range_m, _, _, second_m, _] in rows::<7>("second_trip") {
        close(ambiguous_range_m(rate_hz), ambiguous_m);
        close(range_m + ambiguous_range_m(rate_hz), second_m);
    }
}

#[test]
fn an_ideal_front_end_changes_no_bit_and_impossible_ones_are_refused() {
    let ideal = with(FrontEnd::IDEAL);
    let shot =
        2.0 * wakescope_signal::constants::ELEMENTARY_CHARGE_C * ideal.responsivity_a_w() * 1e-3;
    assert_eq!(ideal.noise_density_a2_hz().to_bits(), shot.to_bits());
    let responsivity = ideal.responsivity_a_w();
    assert_eq!(
        ideal.heterodyne_gain_a2_w().to_bits(),
        (2.0 * responsivity * responsivity * 1e-3).to_bits()
    );
    assert_eq!(ideal.penalties().total_db(), 0.0);
    let refused = |front_end, name| {
        let found = with(front_end).validate();
        assert!(
            matches!(found, Err(Error::OutOfRange { field, .. }) if field == name),
            "{name}: {found:?}"
        );
    };
    refused(
        FrontEnd {
            dark_current_a: -1.0,
            ..FrontEnd::IDEAL
        },
        "dark_current_a",
    );
    refused(
        FrontEnd {
            load_ohm: 0.0,
            ..FrontEnd::IDEAL
        },
        "load_ohm",
    );
    refused(
        FrontEnd {
            saturation_w: f64::NAN,
            ..FrontEnd::IDEAL
        },
        "saturation_w",
    );
    refused(
        FrontEnd {
            intensity_noise_db_hz: 3.0,
            ..FrontEnd::IDEAL
        },
        "intensity_noise_db_hz",
    );
}
