//! Decay of grid turbulence, by which the constants of the subgrid models are judged.
//!
//! Comte-Bellot and Corrsin (1971, J. Fluid Mech. 48, 273-337, table 3) measured the spectra of air behind a grid of mesh
//! M = 5.08 cm at 10 m/s, 42, 98 and 171 M behind it. In a periodic box of 18 pi cm that moves with the air these are three
//! times of one decay. The start has the spectrum of the first station up to the cutoff of the mesh; because random phases
//! transfer no energy, the field decays for a while and is then brought back to that spectrum, its phases kept.
//!
//! `cargo run --release -p wakescope-les --example decaying_turbulence -- 64 none wale:0.5 multi:0.98:3`
//! prints, for each model, the resolved energy over the measured one at the two later stations, and the same for the energy
//! of the upper third of the wave numbers, where a model that takes too little lets energy pile up.
#![allow(clippy::print_stdout)]

use std::f64::consts::TAU;

use rustfft::FftPlanner;
use rustfft::num_complex::Complex;
use wakescope_les::cases::Initial;
use wakescope_les::{Direction, Error, Flow, FlowSettings, Mesh, SubgridModel, TimeStep};

/// Wave number \[1/cm\] and the spectral energy at the three stations \[cm^3/s^2\]. At the first wave number the table has the last station
/// alone: the other two are assumed, and set the largest eddies of the start.
const MEASURED: [(f64, [f64; 3]); 18] = [
    (0.15, [60.0, 72.0, 49.7]),
    (0.2, [129.0, 106.0, 92.0]),
    (0.25, [230.0, 196.0, 120.0]),
    (0.3, [322.0, 195.0, 125.0]),
    (0.4, [435.0, 202.0, 98.0]),
    (0.5, [457.0, 168.0, 81.5]),
    (0.7, [380.0, 127.0, 60.2]),
    (1.0, [270.0, 79.2, 39.4]),
    (1.5, [168.0, 47.8, 24.1]),
    (2.0, [120.0, 34.6, 16.5]),
    (2.5, [89.0, 28.6, 12.5]),
    (3.0, [70.3, 23.1, 9.12]),
    (4.0, [47.0, 14.3, 5.62]),
    (6.0, [24.7, 5.95, 1.69]),
    (8.0, [12.6, 2.23, 0.52]),
    (10.0, [7.42, 0.9, 0.161]),
    (12.5, [3.96, 0.363, 0.052]),
    (15.0, [2.33, 0.162, 0.0141]),
];
/// Times of the stations after the first \[s\].
const STATION_S: [f64; 3] = [0.0, (98.0 - 42.0) * 0.005_08, (171.0 - 42.0) * 0.005_08];
/// Length of the decay that gives the phases their correlations \[s\].
const PREPARATION_S: f64 = 0.1;
/// Air \[m^2/s\].
const VISCOSITY_M2_S: f64 = 1.5e-5;
/// Length of the box \[m\]: wave numbers are multiples of 1/9 per centimetre.
const BOX_M: f64 = 0.09 * TAU;

/// Energy of the shell of wave number `shell` \[m^2/s^2\] at a station, by linear interpolation of the logarithms.
fn measured(shell: usize, station: usize) -> f64 {
    let per_cm = shell as f64 / 9.0;
    let upper = MEASURED
        .iter()
        .position(|row| row.0 >= per_cm)
        .unwrap_or(MEASURED.len() - 1)
        .max(1);
    let (low, high) = (MEASURED[upper - 1], MEASURED[upper]);
    let fraction = (per_cm / low.0).ln() / (high.0 / low.0).ln();
    let logarithm = (1.0 - fraction) * low.1[station].ln() + fraction * high.1[station].ln();
    1e-4 * logarithm.exp() / 9.0
}

type Waves = [Vec<Complex<f64>>; 3];

/// Transforms along all three directions, without scaling.
fn transform(n: usize, field: &mut [Complex<f64>], forward: bool) {
    let mut planner = FftPlanner::new();
    let fft = if forward {
        planner.plan_fft_forward(n)
    } else {
        planner.plan_fft_inverse(n)
    };
    let mut line = vec![Complex::default(); n];
    for stride in [1, n, n * n] {
        for start in (0..n * n * n).filter(|place| place / stride % n == 0) {
            for (i, value) in line.iter_mut().enumerate() {
                *value = field[start + i * stride];
            }
            fft.process(&mut line);
            for (i, value) in line.iter().enumerate() {
                field[start + i * stride] = *value;
            }
        }
    }
}

/// Signed wave numbers of a place in the spectrum.
fn wave_numbers(n: usize, place: usize) -> [f64; 3] {
    [place % n, place / n % n, place / (n * n)].map(|i| {
        if 2 * i < n {
            i as f64
        } else {
            i as f64 - n as f64
        }
    })
}

fn shell(n: usize, place: usize) -> usize {
    wave_numbers(n, place)
        .iter()
        .map(|k| k * k)
        .sum::<f64>()
        .sqrt()
        .round() as usize
}

/// Energy of each shell below the cutoff \[m^2/s^2\].
fn spectrum(n: usize, waves: &Waves) -> Vec<f64> {
    let mut energy = vec![0.0; n / 2];
    for component in waves {
        for (place, amplitude) in component.iter().enumerate() {
            if let Some(energy) = energy.get_mut(shell(n, place)) {
                *energy += 0.5 * amplitude.norm_sqr();
            }
        }
    }
    energy
}

fn waves_of(n: usize, velocity_m_s: &[Vec<f64>; 3]) -> Waves {
    velocity_m_s.each_ref().map(|field| {
        let scale = 1.0 / field.len() as f64;
        let mut waves: Vec<Complex<f64>> =
            field.iter().map(|u| Complex::new(scale * u, 0.0)).collect();
        transform(n, &mut waves, true);
        waves
    })
}

/// Gives the waves the spectrum of the first station, nothing beyond the cutoff, and returns the velocities at the faces.
fn with_measured_spectrum(n: usize, mut waves: Waves) -> [Vec<f64>; 3] {
    let present = spectrum(n, &waves);
    for component in &mut waves {
        for (place, amplitude) in component.iter_mut().enumerate() {
            let shell = shell(n, place);
            let factor = if shell == 0 || shell >= n / 2 {
                0.0
            } else {
                (measured(shell, 0) / present[shell]).sqrt()
            };
            *amplitude *= factor;
        }
        transform(n, component, false);
    }
    waves.map(|component| component.into_iter().map(|u| u.re).collect())
}

/// Uniform numbers from -1/2 to 1/2 (SplitMix64).
fn noise(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed;
    move || {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64 - 0.5
    }
}

fn faces(flow: &Flow) -> [Vec<f64>; 3] {
    [0, 1, 2].map(|direction| flow.face_velocity_m_s(direction))
}

fn start(n: usize, velocity_m_s: &[Vec<f64>; 3], model: SubgridModel) -> Result<Flow, Error> {
    let side = || Direction::periodic(n, 0.0, BOX_M);
    let mesh = Mesh::new(side(), side(), side())?;
    let time_step = TimeStep::Courant {
        courant: 0.35,
        longest_s: 0.01,
    };
    let mut settings = FlowSettings::new(VISCOSITY_M2_S, time_step);
    settings.subgrid = model;
    Ok(Initial::Faces(velocity_m_s.clone())
        .start(mesh, settings)?
        .0)
}

fn run_to(flow: &mut Flow, end_s: f64) -> Result<(), Error> {
    while flow.time_s() < end_s {
        flow.step_towards(end_s)?;
    }
    Ok(())
}

/// The field that all models start from.
fn prepare(n: usize) -> Result<[Vec<f64>; 3], Error> {
    let mut noise = noise(1);
    let white = [0, 1, 2].map(|_| (0..n * n * n).map(|_| noise()).collect());
    // The projection of white noise, then its spectrum.
    let solenoidal = faces(&start(n, &white, SubgridModel::None)?);
    let random = with_measured_spectrum(n, waves_of(n, &solenoidal));
    let mut flow = start(n, &random, SubgridModel::MULTISCALE_WALE)?;
    run_to(&mut flow, PREPARATION_S)?;
    Ok(with_measured_spectrum(n, waves_of(n, &faces(&flow))))
}

/// A model as `none`, `smagorinsky:C`, `wale:C` or `multi:C:ORDER`.
fn parse(text: &str) -> Option<SubgridModel> {
    let mut parts = text.split(':');
    let name = parts.next()?;
    let constant = parts.next().and_then(|c| c.parse().ok());
    match (name, constant) {
        ("none", _) => Some(SubgridModel::None),
        ("smagorinsky", Some(constant)) => Some(SubgridModel::Smagorinsky { constant }),
        ("wale", Some(constant)) => Some(SubgridModel::Wale { constant }),
        ("multi", Some(constant)) => Some(SubgridModel::MultiscaleWale {
            constant,
            order: parts.next()?.parse().ok()?,
        }),
        _ => None,
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let n: usize = arguments.next().map_or(Ok(32), |n| n.parse())?;
    let given: Vec<String> = arguments.collect();
    let models = if given.is_empty() {
        ["none", "wale:0.5", "multi:0.98:3"]
            .map(String::from)
            .to_vec()
    } else {
        given
    };
    let initial = prepare(n)?;
    println!(
        "model             all 98, 171 M/U   upper third 98, 171 M/U   (resolved energy over measured)"
    );
    for text in models {
        let model = parse(&text)
            .ok_or_else(|| format!("{text}: none, smagorinsky:C, wale:C or multi:C:ORDER"))?;
        let mut flow = start(n, &initial, model)?;
        let mut ratios = [[0.0; 2]; 2];
        for station in [1, 2] {
            run_to(&mut flow, STATION_S[station])?;
            let found = spectrum(n, &waves_of(n, &faces(&flow)));
            for (which, first) in [1, n / 3].into_iter().enumerate() {
                let sum: f64 = (first..n / 2).map(|shell| measured(shell, station)).sum();
                ratios[which][station - 1] = found[first..].iter().sum::<f64>() / sum;
            }
        }
        let [[a, b], [c, d]] = ratios;
        println!(
            "{text:18}{a:6.3} {b:6.3}      {c:6.3} {d:6.3}     {} steps",
            flow.steps()
        );
    }
    Ok(())
}
