//! Records as such: draws, reuse of buffers, series, extreme and bad input.

use num_complex::Complex;
use rand::{Rng, RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_xoshiro::Xoshiro256PlusPlus;
use wakescope_signal::literal::literal_envelope;
use wakescope_signal::{
    Error, GaussianPulse, LineOfSight, NoiseModel, Pulse, Record, Scratch, Simulator,
};

use crate::setup::{gaussian, limits, receiver};

fn simulator(pulse: GaussianPulse, noise: NoiseModel, samples: usize) -> Result<Simulator, Error> {
    Simulator::new(
        pulse,
        receiver(noise),
        Record {
            time_of_first_sample_s: 2.67e-6,
            samples,
        },
    )
}

/// A uniform wind around 400 m, which the first sample sees.
fn line(radial_velocity_m_s: f64) -> LineOfSight {
    let layers = 600;
    LineOfSight {
        first_range_m: 300.0,
        layer_thickness_m: Pulse::from(gaussian(200e-9))
            .layer_thickness_m(limits(0.0))
            .unwrap(),
        radial_velocity_m_s: vec![radial_velocity_m_s; layers],
        weight_per_m: vec![3e-17; layers],
    }
}

fn current(
    simulator: &Simulator,
    line: &LineOfSight,
    scratch: &mut Scratch,
    seed: u64,
) -> Vec<f64> {
    let mut current = vec![f64::NAN; simulator.record().samples];
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    simulator
        .record_into(line, &mut rng, scratch, &mut current)
        .unwrap();
    current
}

#[test]
fn draws_are_two_per_layer_whatever_the_mask_then_those_of_the_noise() {
    let mut masked = line(2.0);
    masked.radial_velocity_m_s[10..200].fill(f64::NAN);
    masked.weight_per_m[250..].fill(0.0);
    for (noise, draws) in [(NoiseModel::None, 1200), (NoiseModel::White, 1200 + 30)] {
        let simulator = simulator(gaussian(2e-7), noise, 30).unwrap();
        let mut expected = Xoshiro256PlusPlus::seed_from_u64(21);
        for _ in 0..draws {
            let _: f64 = expected.sample(StandardNormal);
        }
        let expected = expected.next_u64();
        for line in [line(2.0), masked.clone()] {
            let mut rng = Xoshiro256PlusPlus::seed_from_u64(21);
            simulator
                .record_into(&line, &mut rng, &mut Scratch::default(), &mut [0.0; 30])
                .unwrap();
            assert_eq!(rng.next_u64(), expected);
        }
    }
}

#[test]
fn a_mask_silences_its_layers_and_leaves_the_others_as_they_were() {
    let simulator = simulator(gaussian(2e-7), NoiseModel::None, 200).unwrap();
    let (mut near, mut far) = (line(2.0), line(2.0));
    near.radial_velocity_m_s[250..].fill(f64::NAN);
    far.radial_velocity_m_s[..250].fill(f64::NAN);
    let mut scratch = Scratch::default();
    let mut run = |line: &LineOfSight| current(&simulator, line, &mut scratch, 6);
    let (near, far, all) = (run(&near), run(&far), run(&line(2.0)));
    let largest = all.iter().fold(0.0_f64, |m, i| m.max(i.abs()));
    for ((near, far), all) in near.iter().zip(&far).zip(&all) {
        assert!((near + far - all).abs() < 1e-12 * largest);
    }
}

#[test]
fn reused_scratch_does_not_leak_from_one_line_to_the_next() {
    let simulator = simulator(gaussian(2e-7), NoiseModel::BandLimited, 200).unwrap();
    let mut short = line(4.0);
    short.radial_velocity_m_s.truncate(77);
    short.weight_per_m.truncate(77);
    short.layer_thickness_m = 0.5;
    let mut used = Scratch::default();
    current(&simulator, &line(-9.0), &mut used, 9);
    assert_eq!(
        current(&simulator, &short, &mut used, 4),
        current(&simulator, &short, &mut Scratch::default(), 4)
    );
}

#[test]
fn air_that_returns_nothing_gives_exactly_nothing() {
    let simulator = simulator(gaussian(2e-7), NoiseModel::None, 100).unwrap();
    let far = |first_range_m: f64| LineOfSight {
        first_range_m,
        ..line(5.0)
    };
    let weightless = LineOfSight {
        weight_per_m: vec![0.0; 600],
        ..line(5.0)
    };
    let mut power = [1.0; 100];
    for line in [weightless, line(f64::NAN), far(5e3), far(-5e3), far(1e300)] {
        let current = current(&simulator, &line, &mut Scratch::default(), 1);
        assert!(current.iter().all(|i| *i == 0.0));
        simulator
            .mean_power_into(&line, &mut Scratch::default(), &mut power)
            .unwrap();
        assert!(power.iter().all(|p| *p == 0.0));
    }
}

#[test]
fn velocities_beyond_the_band_and_pulses_longer_than_the_record_are_no_trouble() {
    let fast = line(500.0);
    let speckle = vec![Complex::new(0.6, 0.8); fast.layers()];
    for duration_s in [2e-7, 5e-6] {
        let simulator = simulator(gaussian(duration_s), NoiseModel::None, 16).unwrap();
        let mut envelope = vec![Complex::ZERO; 16];
        simulator
            .envelope_of_speckle_into(&fast, &speckle, &mut Scratch::default(), &mut envelope)
            .unwrap();
        let literal = literal_envelope(&simulator, &fast, &speckle).unwrap();
        // Equal amplitudes at one velocity cancel nothing, so each sample is of the
        // size of the whole.
        for (a, b) in envelope.iter().zip(&literal) {
            assert!(b.norm() > 0.0 && (a - b).norm() < 1e-9 * b.norm());
        }
    }
}

#[test]
fn bad_input_is_refused_by_name() {
    let simulator_of = |samples| simulator(gaussian(2e-7), NoiseModel::None, samples);
    let good = simulator_of(10).unwrap();
    let run = |line: &LineOfSight, places: usize| {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
        good.record_into(
            line,
            &mut rng,
            &mut Scratch::default(),
            &mut vec![0.0; places],
        )
    };
    assert_eq!(run(&line(1.0), 10), Ok(()));
    assert!(matches!(
        run(&line(1.0), 9),
        Err(Error::LengthMismatch {
            field: "out_a",
            found: 9,
            expected: 10
        })
    ));
    assert!(matches!(
        run(&LineOfSight::default(), 10),
        Err(Error::OutOfRange {
            field: "layer_thickness_m",
            ..
        })
    ));
    let empty = LineOfSight {
        layer_thickness_m: 0.6,
        ..LineOfSight::default()
    };
    assert!(matches!(run(&empty, 10), Err(Error::Empty { .. })));
    let thin = LineOfSight {
        layer_thickness_m: 1e-9,
        ..line(1.0)
    };
    assert!(matches!(
        run(&thin, 10),
        Err(Error::OutOfRange {
            field: "layer_thickness_m",
            ..
        })
    ));
    assert!(matches!(
        run(&line(f64::INFINITY), 10),
        Err(Error::ElementOutOfRange { .. })
    ));
    assert!(matches!(
        simulator_of(0),
        Err(Error::OutOfRange {
            field: "samples",
            ..
        })
    ));
    let few = good.envelope_of_speckle_into(
        &line(1.0),
        &[],
        &mut Scratch::default(),
        &mut [Complex::ZERO; 10],
    );
    assert!(matches!(
        few,
        Err(Error::LengthMismatch {
            field: "speckle",
            ..
        })
    ));
    let steep = Pulse::from(gaussian(2e-7)).layer_thickness_m(limits(f64::NAN));
    assert!(matches!(
        steep,
        Err(Error::OutOfRange {
            field: "max_gradient_per_s",
            ..
        })
    ));
}
