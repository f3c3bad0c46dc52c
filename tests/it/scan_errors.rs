//! Errors of the velocity estimators on a scan of the analytic vortex pair, against the velocity weighted with the pulse and with
//! pulse and window.

use fixtures::WINDOW;
use fixtures::pair::{PairCase, PairScan};
use wakescope_estimate::{
    Correlogram, Scratch, SignalKind, Weighting, estimators::*, map::*, spectrum::unweighted_lags,
};
use wakescope_signal::NoiseModel;

/// Root-mean-square errors of an estimator: against the velocity of the pulse within 8 m of a core and beyond 30 m from
/// both, and against that of the gate within 8 m, m/s.
#[derive(Debug)]
struct Errors {
    inside_m_s: f64,
    outside_m_s: f64,
    gate_inside_m_s: f64,
}

fn errors(scene: &PairScan, scans: &[Scan], estimator: &dyn Estimator) -> Errors {
    let inside = |i: &usize| scene.distance_m[*i] < 8.0;
    let chosen: Vec<usize> = (0..scene.points.len())
        .filter(|i| inside(i) || (scene.distance_m[*i] > 30.0 && i % 23 == 0))
        .collect();
    let points: Vec<PolarPoint> = chosen.iter().map(|&i| scene.points[i]).collect();
    let (mut squares, mut counts) = ([0.0; 3], [0.0; 3]);
    for scan in scans {
        let map = scan
            .map(&points, &Radius::Fixed { radius_m: 2.0 }, None, estimator)
            .unwrap();
        for (found, i) in map.iter().zip(&chosen) {
            let error = |truth_m_s: &[f64]| (found.estimate.velocity_m_s - truth_m_s[*i]).powi(2);
            let place = usize::from(!inside(i));
            squares[place] += error(&scene.v_pulse_m_s);
            counts[place] += 1.0;
            if inside(i) {
                squares[2] += error(&scene.v_gate_m_s);
                counts[2] += 1.0;
            }
        }
    }
    let rms = |k: usize| (squares[k] / f64::from(counts[k] as u32)).sqrt();
    Errors {
        inside_m_s: rms(0),
        outside_m_s: rms(1),
        gate_inside_m_s: rms(2),
    }
}

/// PA, CA and the first moment on the scan, rho = 2 m, one pulse per line.
fn all_errors(snr_db: f64) -> [Errors; 3] {
    let scene = PairScan::new(NoiseModel::BandLimited, 200e-9, snr_db, 3, 1).unwrap();
    let statistic = Correlogram::<f64>::new(Weighting::Rectangular, WINDOW).unwrap();
    let (sampling, kind, refinement) = (&scene.sampling, SignalKind::Real, Refinement::Parabola);
    let scans: Vec<Scan> = (0..2)
        .map(|scan| {
            scene
                .statistics(&scene.records(scan).unwrap(), &statistic)
                .unwrap()
        })
        .collect();
    let estimators: [Box<dyn Estimator>; 3] = [
        Box::new(
            SpectralPeak::new(sampling, kind, &unweighted_lags(WINDOW), 1024, refinement).unwrap(),
        ),
        Box::new(ModelPeak::new(sampling, kind, WINDOW, 16, 2048, refinement).unwrap()),
        Box::new(FirstMoment::new(sampling, kind, &unweighted_lags(WINDOW), 512, 3.5).unwrap()),
    ];
    estimators.map(|estimator| errors(&scene, &scans, estimator.as_ref()))
}

#[test]
fn errors_on_the_vortex_pair_at_0_db_are_those_of_an_independent_study() {
    let [pa, ca, _] = all_errors(0.0);
    // 3.2 and 0.49 m/s for PA, 3.1 and 0.38 m/s for CA; the rms of some 45 independent places inside is known to 5 %
    for (found_m_s, study_m_s) in [
        (pa.inside_m_s, 3.2),
        (pa.outside_m_s, 0.49),
        (ca.inside_m_s, 3.1),
        (ca.outside_m_s, 0.38),
    ] {
        assert!(
            (found_m_s / study_m_s - 1.0).abs() < 0.13,
            "{found_m_s} {study_m_s}"
        );
    }
    // Inside the two are alike: claim CP1 of the figures measures their ratio over many scans.
    assert!(
        (ca.inside_m_s / pa.inside_m_s - 1.0).abs() < 0.1,
        "{ca:?} {pa:?}"
    );
    assert!(ca.outside_m_s < 0.85 * pa.outside_m_s, "{ca:?} {pa:?}");
}

#[test]
fn at_20_db_only_the_moment_stays_below_the_periodogram() {
    let [pa, ca, moment] = all_errors(20.0);
    // the model of order 16 takes the highest peak all the more: the claim "CA below PA" turns round
    assert!(ca.inside_m_s > pa.inside_m_s, "{ca:?} {pa:?}");
    assert!(
        moment.inside_m_s < 1.3 && moment.outside_m_s < ca.outside_m_s,
        "{moment:?} {ca:?}"
    );
    assert!(moment.gate_inside_m_s < 0.8, "{moment:?}");
}

/// The mean of the density in the whole band less its median, where it is above.
struct AboveMedian(SpectralPeak);

impl Estimator for AboveMedian {
    fn statistic_len(&self) -> usize {
        self.0.statistic_len()
    }

    fn estimate(&self, mean: &[f64], scratch: &mut Scratch) -> GateVelocity {
        let density = self.0.band_density(mean, scratch).unwrap();
        let mut sorted = density.to_vec();
        sorted.sort_by(f64::total_cmp);
        let above = density
            .iter()
            .map(|d| (d - sorted[sorted.len() / 2]).max(0.0));
        let velocity = self
            .0
            .band_frequencies_hz()
            .into_iter()
            .map(|f_hz| self.0.sampling().velocity_m_s(f_hz));
        let (sum, once) = above
            .zip(velocity)
            .fold((0.0, 0.0), |(sum, once), (d, v)| (sum + d, once + d * v));
        GateVelocity {
            velocity_m_s: once / sum,
            ..GateVelocity::none(Quality::Good)
        }
    }
}

/// Errors outside the vortices at 0 dB in a wind across the runway: of the first moment with two reaches, and of the mean
/// above the median.
fn moments_outside_m_s(wind_m_s: f64) -> [f64; 3] {
    let case = PairCase {
        wind_m_s,
        ..PairCase::FIGURES
    };
    let scene = PairScan::of(&case, NoiseModel::BandLimited, 200e-9, 0.0, 3, 1).unwrap();
    let statistic = Correlogram::<f64>::new(Weighting::Rectangular, WINDOW).unwrap();
    let (sampling, kind) = (&scene.sampling, SignalKind::Real);
    let scan = scene
        .statistics(&scene.records(0).unwrap(), &statistic)
        .unwrap();
    let moment = |reach| {
        Box::new(FirstMoment::new(sampling, kind, &unweighted_lags(WINDOW), 512, reach).unwrap())
    };
    let peak = SpectralPeak::new(
        sampling,
        kind,
        &unweighted_lags(WINDOW),
        512,
        Refinement::Parabola,
    )
    .unwrap();
    let estimators: [Box<dyn Estimator>; 3] =
        [moment(3.5), moment(2.0), Box::new(AboveMedian(peak))];
    estimators.map(|estimator| {
        errors(&scene, std::slice::from_ref(&scan), estimator.as_ref()).outside_m_s
    })
}

#[test]
fn a_mean_over_the_whole_band_is_good_in_calm_air_only_where_noise_pulls_it_to_the_truth() {
    let ([wide, narrow, above], [windy_wide, windy_narrow, windy_above]) =
        (moments_outside_m_s(0.0), moments_outside_m_s(8.0));
    assert!(
        above < wide && (0.55..0.85).contains(&above),
        "{above} {wide}"
    );
    assert!(
        windy_above > windy_wide && windy_above > 1.35 * above,
        "{windy_above} {windy_wide}"
    );
    // a narrow window needs no such help
    assert!(
        narrow < above && windy_narrow < 0.6 * windy_above,
        "{narrow} {windy_narrow}"
    );
}
