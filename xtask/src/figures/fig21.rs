//! Figure 21: one wake seen across, round and along the flight path at the same energy, and what each scan says of its circulation.

use super::context::*;
use rayon::prelude::*;
use serde::Deserialize;
use std::path::Path;
use wakescope_les::{VortexPair, Wind};
use wakescope_signal::RangeFilter;
use wakescope_sim::measure::map::VelocityEstimates;
use wakescope_sim::plot::Panel;
use wakescope_sim::retrieve::RetrievalRow;
use wakescope_sim::scene::{self, Flow};
use wakescope_sim::setup::estimators::weighting;
use wakescope_sim::setup::wind::vortex_pair;
use wakescope_sim::write::velocity_map;

/// Lines of sight of each scan.
const LINES: usize = 72;
/// What is fitted: circulation, lateral position and height of the middle, distance of the vortices, in steps of derivatives.
const STEPS: [f64; 4] = [1.0, 0.05, 0.05, 0.05];
/// Most steps of a fit.
const ROUNDS: usize = 30;

/// Values of what is fitted.
type Parameters = [f64; 4];

/// One scan: its velocities, and the circulation \[m^2/s\] that each method finds.
struct Scan {
    plan: Plan,
    map: VelocityEstimates,
    /// `means`: by means of gates; `fit`: by what the estimator shows, as `[retrieval]` fits scans across the flight.
    found_m2_s: Vec<(&'static str, Option<f64>)>,
}

/// One way to look at the wake.
struct View {
    name: String,
    scans: Vec<Scan>,
}

/// Circulations \[m^2/s\] of all scans of a view by one method, and how many fits failed.
struct Fits<'a> {
    view: &'a View,
    method: &'static str,
    known_m2_s: Vec<f64>,
    failures: usize,
}

/// Circulation of the pair \[m^2/s\].
fn true_m2_s() -> f64 {
    scene::VortexPair::default().circulation_m2_s
}

/// The ways to look at the wake, each with its scene.
#[derive(Deserialize)]
struct List {
    view: Vec<(String, String)>,
}

pub(super) fn make(context: &Context) -> Result<Rendered, Failure> {
    let scans = context.profile.choose(2, 40, 100);
    let List { view: listed } = toml::from_str(include_str!("fig21.toml"))?;
    let views = listed
        .into_iter()
        .map(|listed| view(context, listed, scans));
    let views = views.collect::<Result<Vec<View>, Failure>>()?;
    let mut out = Rendered::new(
        &table(&views),
        &picture(&views)?,
        &views[0].scans[0].plan.scene.provenance(),
    )?;
    out.marks = vec!["analytic pair".into()];
    out.values = vec![LINES.to_string(), scans.to_string()];
    out.claims = claims(&views);
    Ok(out)
}

fn view(context: &Context, (name, scene): (String, String), scans: u64) -> Result<View, Failure> {
    let scene = SceneFile::parse(&scene, Path::new("fig21.toml"))?.content;
    let one = |scan: u64| -> Result<Scan, Failure> {
        let mut file = context.scene_file(scene.clone())?;
        file.content.seed += scan;
        let plan = Plan::new(
            file,
            if scene.retrieval.is_some() {
                Target::Run
            } else {
                Target::Map
            },
        )?;
        let result = wakescope_sim::run(&plan, &Silent)?;
        let map = result
            .map
            .ok_or_else(|| Failure::new("a run without a map".into()))?;
        let mut found_m2_s = vec![("means", fit(&plan, &map.v_scan_m_s)?)];
        found_m2_s.extend(
            result
                .retrieval
                .map(|retrieval| ("fit", retrieved(&retrieval.rows))),
        );
        Ok(Scan {
            plan,
            map,
            found_m2_s,
        })
    };
    Ok(View {
        name,
        scans: (0..scans)
            .into_par_iter()
            .map(one)
            .collect::<Result<_, _>>()?,
    })
}

/// The mean of both circulations that the scene's own retrieval finds, m^2/s.
fn retrieved(rows: &[RetrievalRow]) -> Option<f64> {
    let found: Option<Vec<f64>> = rows
        .iter()
        .map(|row| Some(row.found?.circulation_m2_s.value))
        .collect();
    found
        .filter(|found| found.len() == 2)
        .map(|found| 0.5 * (found[0] + found[1]))
}

/// The circulation of which means of gates fit a scan best, m^2/s; nothing where the fit leaves what it can know.
fn fit(plan: &Plan, seen_m_s: &Array2<f64>) -> Result<Option<f64>, Failure> {
    let Flow::VortexPair(pair) = plan.scene.content.flow else {
        return Ok(None);
    };
    let truth = vortex_pair(&pair);
    // Not from the truth itself.
    let mut at: Parameters = [
        0.8 * true_m2_s(),
        truth.lateral_position_m + 3.0,
        truth.height_m - 3.0,
        truth.spacing_m + 2.0,
    ];
    let squares = |model: &[f64]| -> f64 {
        seen_m_s
            .iter()
            .zip(model)
            .filter(|(seen, _)| seen.is_finite())
            .map(|(seen, v)| (seen - v).powi(2))
            .sum()
    };
    let mut model = model_m_s(plan, &truth, &at)?;
    let mut damping = 1e-3;
    for _ in 0..ROUNDS {
        let mut columns = Vec::new();
        // Velocities are in proportion to the circulation.
        columns.push(model.iter().map(|v| v / at[0]).collect::<Vec<f64>>());
        for (which, step) in STEPS.into_iter().enumerate().skip(1) {
            let mut beside = at;
            beside[which] += step;
            let moved = model_m_s(plan, &truth, &beside)?;
            columns.push(
                moved
                    .iter()
                    .zip(&model)
                    .map(|(a, b)| (a - b) / step)
                    .collect::<Vec<f64>>(),
            );
        }
        let residuals: Vec<f64> = seen_m_s
            .iter()
            .zip(&model)
            .map(|(seen, v)| seen - v)
            .collect();
        let known = |of: &dyn Fn(usize) -> f64| {
            (0..residuals.len())
                .filter(|i| residuals[*i].is_finite())
                .map(of)
                .sum()
        };
        let mut matrix: [[f64; 5]; 4] = [[0.0; 5]; 4];
        for row in 0..4 {
            for column in 0..4 {
                matrix[row][column] = known(&|i| columns[row][i] * columns[column][i]);
            }
            matrix[row][row] *= 1.0 + damping;
            matrix[row][4] = known(&|i| columns[row][i] * residuals[i]);
        }
        let step = solved(matrix);
        if step
            .iter()
            .zip(STEPS)
            .all(|(change, unit)| change.abs() < 0.2 * unit)
        {
            return Ok(Some(at[0]));
        }
        let next: Parameters = std::array::from_fn(|i| at[i] + step[i]);
        let inside =
            (50.0..2000.0).contains(&next[0]) && (10.0..100.0).contains(&next[3]) && next[2] > 5.0;
        let moved = if inside {
            model_m_s(plan, &truth, &next)?
        } else {
            Vec::new()
        };
        if !inside || squares(&moved) > squares(&model) {
            damping *= 10.0;
            continue;
        }
        (at, model, damping) = (next, moved, 0.1 * damping);
    }
    Ok(None)
}

/// Velocities that pulse and window make of a pair, one line after the other, m/s.
fn model_m_s(plan: &Plan, pair: &VortexPair, parameters: &Parameters) -> Result<Vec<f64>, Failure> {
    let [
        circulation_m2_s,
        lateral_position_m,
        height_m,
        pair_spacing_m,
    ] = *parameters;
    let wind = VortexPair {
        circulation_m2_s,
        lateral_position_m,
        height_m,
        spacing_m: pair_spacing_m,
        ..*pair
    }
    .wind()?;
    let (scene, g) = (&plan.scene.content, &plan.geometry);
    let window = weighting(scene).weights(scene.estimator.window_samples)?;
    // Every fourth layer is enough for means over gates of some 40 m.
    let spacing_m = 4.0 * g.layer_thickness_m;
    let filter = RangeFilter::gate(
        &plan.instrument.pulse,
        &window,
        scene.detector.sampling_hz,
        spacing_m,
    )?;
    let ranges_m: Vec<f64> = g.layer_range_m().step_by(4).collect();
    let mut gates_m_s = vec![0.0; g.gate_range_m.len()];
    let mut velocity_m_s = vec![[0.0; 3]; ranges_m.len()];
    let mut out = Vec::with_capacity(g.schedule.lines.len() * gates_m_s.len());
    for line in 0..g.schedule.lines.len() {
        let beam = g.schedule.middle(line);
        let points: Vec<[f64; 3]> = ranges_m
            .iter()
            .map(|range_m| beam.at_range_m(*range_m))
            .collect();
        wind.velocity_into(&points, 0.0, &mut velocity_m_s)?;
        let along: Vec<f64> = velocity_m_s
            .iter()
            .map(|v| beam.direction.radial_velocity_m_s(*v, beam.velocity_m_s))
            .collect();
        filter.apply_into(
            g.first_layer_range_m,
            &along,
            &g.gate_range_m,
            &mut gates_m_s,
        )?;
        out.extend(&gates_m_s);
    }
    Ok(out)
}

/// The solution of four equations by elimination; their matrix is positive.
fn solved(mut m: [[f64; 5]; 4]) -> Parameters {
    for pivot in 0..4 {
        let line = m[pivot];
        for (_, other) in m.iter_mut().enumerate().filter(|(row, _)| *row != pivot) {
            let share = other[pivot] / line[pivot];
            other
                .iter_mut()
                .zip(line)
                .for_each(|(a, b)| *a -= share * b);
        }
    }
    std::array::from_fn(|i| m[i][4] / m[i][i])
}

impl View {
    fn energy_j(&self) -> f64 {
        let plan = &self.scans[0].plan;
        plan.geometry.schedule.pulses() as f64 * plan.scene.content.pulse_energy_j()
    }

    /// By method.
    fn fits(&self) -> Vec<Fits<'_>> {
        let of = |(place, (method, _)): (usize, &(&'static str, Option<f64>))| {
            let known_m2_s: Vec<f64> = self
                .scans
                .iter()
                .filter_map(|scan| scan.found_m2_s[place].1)
                .collect();
            let failures = self.scans.len() - known_m2_s.len();
            Fits {
                view: self,
                method,
                known_m2_s,
                failures,
            }
        };
        self.scans[0]
            .found_m2_s
            .iter()
            .enumerate()
            .map(of)
            .collect()
    }
}

fn table(views: &[View]) -> Table {
    let rows: Vec<Fits<'_>> = views.iter().flat_map(View::fits).collect();
    let column = |of: &dyn Fn(&Fits<'_>) -> f64| rows.iter().map(of).collect::<Vec<_>>();
    Table::new()
        .text("scan", rows.iter().map(|row| row.view.name.clone()))
        .float("energy_j", column(&|row| row.view.energy_j()))
        .float(
            "duration_s",
            column(&|row| row.view.scans[0].plan.geometry.schedule.duration_s()),
        )
        .text("method", rows.iter().map(|row| row.method))
        .float("gamma_true_m2_s", column(&|_| true_m2_s()))
        .float(
            "gamma_m2_s",
            column(&|row| Estimate::mean(&row.known_m2_s).value),
        )
        .float(
            "gamma_std_m2_s",
            column(&|row| Estimate::deviation(&row.known_m2_s)),
        )
        .int("failures", rows.iter().map(|row| row.failures as i64))
        .int("scans", rows.iter().map(|row| row.view.scans.len() as i64))
}

fn picture(views: &[View]) -> Result<Figure, Failure> {
    let mut panels: Vec<Panel> = Vec::new();
    for view in views {
        let map = velocity_map(&view.scans[0].plan, &view.scans[0].map);
        // The row through the vortices.
        let sweep = if view.name == "rhi" {
            0
        } else {
            map.sweeps.len() / 2
        };
        let plot = MapPlot::new(&map, sweep, "v_scan")?;
        panels.push(
            plot.titled(&format!("{}, one scan", view.name))
                .labelled("m/s")
                .into(),
        );
    }
    let axis = Axis::linear("scan and method");
    let mut plot = CurvePlot::new(
        "Circulation of each scan",
        axis,
        Axis::linear("circulation [m²/s]"),
    );
    plot.shape = 0.6;
    for (place, fits) in views.iter().flat_map(View::fits).enumerate() {
        let points = fits
            .known_m2_s
            .iter()
            .map(|found| (1.0 + place as f64, *found));
        let label = format!("{} {}, {}", place + 1, fits.view.name, fits.method);
        plot = plot.with(Series::new(&label, Style::Markers, points).in_colour(place));
    }
    plot = plot.with(
        Series::new(
            "truth",
            Style::Dash,
            [(0.5, true_m2_s()), (4.5, true_m2_s())],
        )
        .in_colour(4),
    );
    // Beside the scan across the flight, which is wider than high.
    panels.insert(1, plot.into());
    let mut figure = Figure::stacked(panels);
    (figure.columns, figure.width) = (2, 1200.0);
    Ok(figure)
}

fn claims(views: &[View]) -> Vec<Claim> {
    let energies: Vec<String> = views
        .iter()
        .map(|view| format!("{:.4}", view.energy_j()))
        .collect();
    let of = |name: &str, method: &str| {
        let fits = views
            .iter()
            .flat_map(View::fits)
            .find(|fits| fits.view.name == name && fits.method == method);
        fits.map(|fits| (Estimate::mean(&fits.known_m2_s), fits.failures))
    };
    let mut out = vec![Claim::exact(
        "F21a",
        energies.join(", "),
        energies.iter().all(|energy| *energy == energies[0]),
    )];
    for (id, name, method) in [("F21b", "rhi", "fit"), ("F21c", "axial", "means")] {
        out.extend(of(name, method).map(|(found, failures)| {
            let bar = Bar::Between(0.9 * true_m2_s(), 1.1 * true_m2_s());
            Claim::judged_alone(id, found, " m²/s", bar)
                .of_fits(failures, &format!("{failures} fits failed"))
        }));
    }
    for (id, name) in [("F21d", "rhi"), ("F21e", "ppi")] {
        let low = Bar::Below(0.85 * true_m2_s());
        out.extend(
            of(name, "means").map(|(found, _)| Claim::judged_alone(id, found, " m²/s", low)),
        );
    }
    out
}
