//! The curves as the crates compute them now, one function for each.

use crate::failure::Failure;
use wakescope_estimate::{
    SignalKind,
    bound::{Noise, WindowModel},
};
use wakescope_les::cases::{TollmienSchlichting, VortexPairCase};
use wakescope_les::winds::m4_prime as kernel;
use wakescope_les::{Flow, Ground, Motion, VortexPair};
use wakescope_optics::{RadiusDefinition, SnrModel, Telescope, theory};
use wakescope_sim::measure::progress::Silent;
use wakescope_sim::plan::{Plan, Target};
use wakescope_sim::scene::{Scene, SceneFile, SnrReference};
use wakescope_sim::{measure::profile, measure::run};

type Values = Result<Vec<f64>, Failure>;

fn each<E: Into<Failure>>(x: &[f64], f: impl Fn(f64) -> Result<f64, E>) -> Values {
    x.iter().map(|&x| f(x).map_err(Into::into)).collect()
}

pub(super) fn eta_intensity_radius(range_m: &[f64]) -> Values {
    each(range_m, |r| theory::free_space_efficiency(&Telescope::table2(), r))
}

pub(super) fn eta_field_radius(range_m: &[f64]) -> Values {
    let telescope = Telescope { radius_definition: RadiusDefinition::Field, ..Telescope::table2() };
    each(range_m, |r| theory::free_space_efficiency(&telescope, r))
}

pub(super) fn eta_hankel(range_m: &[f64]) -> Values {
    each(range_m, |r| theory::free_space_efficiency_hankel(&Telescope::table2(), r))
}

pub(super) fn eta_untruncated(range_m: &[f64]) -> Values {
    each(range_m, |r| theory::untruncated_efficiency(&Telescope::table2(), r))
}

pub(super) fn snr_free_space(range_m: &[f64]) -> Values {
    let model = SnrModel::table2();
    each(range_m, |r| model.snr(r, theory::free_space_efficiency(&Telescope::table2(), r)?))
}

pub(super) fn m4_prime(x: &[f64]) -> Values {
    Ok(x.iter().map(|&x| kernel(x)).collect())
}

/// The pair of the stored hyperbola: released at the height of its own spacing.
fn unit_pair() -> VortexPair {
    VortexPair {
        circulation_m2_s: 2.0 * std::f64::consts::PI,
        spacing_m: 1.0,
        core_radius_m: 1e-3,
        lateral_position_m: 0.0,
        height_m: 1.0,
        ground: Ground::Image,
        profile: wakescope_les::CirculationProfile::Algebraic,
        motion: Motion::Inviscid,
    }
}

/// Growth rates of the least stable waves on plane Poiseuille flow, at the wave numbers of the stored file.
pub(super) fn growth_rates(reynolds: &[f64]) -> Values {
    each(reynolds, |re| {
        let alpha = if re == 5772.22 { 1.02056 } else { 1.0 };
        Ok::<f64, wakescope_les::Error>(TollmienSchlichting::new(re, alpha)?.omega.im)
    })
}

/// Enstrophy of the plane vortex pair over a sticky ground at Re 2500, on a mesh of 192 x 96 cells.
pub(super) fn pair_enstrophy(tau: &[f64]) -> Values {
    let reynolds = 2500.0;
    let pair = VortexPairCase {
        cells: [1, 192, 96],
        size: [1.0, 6.0, 3.0],
        core_radius: 0.12,
        profile: wakescope_les::CirculationProfile::LambOseen,
        reynolds,
        perturbation: 0.0,
        ..VortexPairCase::default()
    };
    let (mut flow, _) = pair.case(VortexPairCase::steps(0.01))?.start()?;
    let viscosity = 2.0 * std::f64::consts::PI / reynolds;
    let mut values = Vec::new();
    for &tau in tau {
        while flow.time_s() < tau {
            flow.step_towards(tau)?;
        }
        // The power that a step reports is that of its start: a copy of the flow makes the step.
        let faces = [0, 1, 2].map(|d| flow.face_velocity_m_s(d));
        let (mut here, _) = Flow::from_face_velocities(
            flow.mesh().clone(),
            flow.settings().clone(),
            faces.each_ref().map(Vec::as_slice),
        )?;
        values.push(-0.5 * here.step()?.viscous_power_m5_s3 / viscosity);
    }
    Ok(values)
}

pub(super) fn pair_y(tau: &[f64]) -> Values {
    let pair = unit_pair();
    Ok(tau.iter().map(|&tau| pair.centres(pair.time_s(tau)).right_y_m).collect())
}

pub(super) fn pair_z(tau: &[f64]) -> Values {
    let pair = unit_pair();
    Ok(tau.iter().map(|&tau| pair.centres(pair.time_s(tau)).height_m).collect())
}

/// The windows of the stored bound: 64 samples at 250 MHz, 200 ns, white noise of the density that
/// gives the SNR in 50 MHz.
fn bound_m_s(snr_db: &[f64], kind: SignalKind) -> Values {
    let scene = Scene::default();
    let sampling = wakescope_sim::measure::estimators::sampling(&scene)?;
    let model = WindowModel::gaussian_pulse(&sampling, 64, scene.pulse_sigma_s(), Noise::White)?;
    each(snr_db, |snr_db| model.bound_m_s(0.0, 10f64.powf(0.1 * snr_db), kind, 1.0))
}

pub(super) fn bound_complex(snr_db: &[f64]) -> Values {
    bound_m_s(snr_db, SignalKind::Complex)
}

pub(super) fn bound_real(snr_db: &[f64]) -> Values {
    bound_m_s(snr_db, SignalKind::Real)
}

fn checked(scene: Scene) -> Result<SceneFile, Failure> {
    SceneFile::new(scene).map_err(|problems| Failure::new(format!("{problems:?}")))
}

/// A single line through the near vortex, one realisation at 10 dB.
fn line_scene() -> Scene {
    let mut scene = Scene::default();
    scene.detector.snr = SnrReference::Fixed { snr_db: 10.0 };
    scene.scan.elevation_min_rad = 0.115;
    scene.scan.elevation_max_rad = 0.135;
    scene.scan.pulses_per_line = 1;
    scene.scan.realisations = 1;
    scene
}

fn line_map() -> Result<wakescope_sim::measure::map::VelocityEstimates, Failure> {
    let plan = Plan::new(checked(line_scene())?, Target::Map)?;
    run::run(&plan, &Silent)?.map.ok_or_else(|| Failure::new("the plan gave no map".into()))
}

pub(super) fn map_line_ranges() -> Vec<f64> {
    Plan::new(SceneFile::new(line_scene()).unwrap_or_else(|p| unreachable!("{p:?}")), Target::Map)
        .map(|p| p.geometry.gate_range_m)
        .unwrap_or_default()
}

pub(super) fn map_line_velocity(_: &[f64]) -> Values {
    let map = line_map()?;
    Ok(map.v_mean_m_s.row(map.elevation_rad.len() / 2).to_vec())
}

pub(super) fn profile_ranges() -> Vec<f64> {
    let o = Scene::default().outputs;
    let step = (o.profile_range_max_m - o.profile_range_min_m) / (o.profile_points - 1) as f64;
    (0..o.profile_points).map(|i| o.profile_range_min_m + i as f64 * step).collect()
}

pub(super) fn profile_snr(_: &[f64]) -> Values {
    let file = SceneFile::new(Scene::default()).unwrap_or_else(|p| unreachable!("{p:?}"));
    Ok(profile::range_profile(&Plan::new(file, Target::Efficiency)?, &Silent)?.snr_db)
}
