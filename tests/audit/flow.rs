//! Flows and wakes: histories against their own columns and files, what a step may do to the energy, limits of the Courant number.

use super::ledger::Ledger;
use super::program::{Bench, Csv, Ended};
use super::random::Random;
use std::f64::consts::PI;

/// steps.csv among its own columns (page Simulating a flow, Files).
fn hold_steps(ledger: &mut Ledger, steps: &Csv) {
    let f = |name: &str| steps.f(name);
    let (time, step, energy) = (f("time_s"), f("step_s"), f("kinetic_energy_m5_s2"));
    let powers = [
        "viscous_power_m5_s3",
        "subgrid_power_m5_s3",
        "force_power_m5_s3",
    ]
    .map(f);
    let (rate, residual) = (f("energy_rate_m5_s3"), f("energy_residual_m5_s3"));
    let power = |i: usize| powers.iter().map(|p| p[i]).sum::<f64>();
    for i in 1..steps.len() {
        ledger.equal("steps.csv: step", f("step")[i], f("step")[i - 1] + 1.0, 0.0);
        ledger.equal(
            "steps.csv: time_s",
            time[i],
            time[i - 1] + step[i],
            1e-9 * time[i],
        );
        ledger.equal(
            "steps.csv: step_s",
            step[i],
            time[i] - time[i - 1],
            1e-9 * time[i],
        );
        let right = (energy[i] - energy[i - 1]) / step[i];
        let round_off = 1e-12 * energy[i] / step[i];
        // The last row has no step behind it, whose powers it would need.
        if i + 1 == steps.len() {
            continue;
        }
        ledger.equal("steps.csv: energy_rate_m5_s3", rate[i], right, round_off);
        // The mean of the powers at both ends: the next step's row has those at its start.
        let right = rate[i] - 0.5 * (power(i) + power(i + 1));
        ledger.equal(
            "steps.csv: energy_residual_m5_s3",
            residual[i],
            right,
            round_off,
        );
        ledger.holds(
            "steps.csv: relative_divergence",
            f("relative_divergence")[i] < 1e-8,
            "the flow has sources",
        );
        ledger.holds(
            "steps.csv: viscous_power_m5_s3",
            powers[0][i] <= 0.0,
            "viscosity that feeds",
        );
        ledger.holds(
            "steps.csv: subgrid_power_m5_s3",
            powers[1][i] <= 0.0,
            "a model that feeds",
        );
        ledger.equal(
            "steps.csv: force_power_m5_s3, without force",
            powers[2][i],
            0.0,
            0.0,
        );
    }
}

/// A small wake: its histories, Gamma over the radii that are asked for, modes, notes.
pub(crate) fn hold_wake(r: &mut Random, bench: &Bench, ledger: &mut Ledger) {
    let (b0, gamma) = (r.between(20.0, 60.0), r.between(200.0, 600.0));
    let (low, high) = (r.between(0.12, 0.2) * b0, r.between(0.25, 0.35) * b0);
    let radii = format!("[{low:.1}, {high:.1}]");
    let (y, z) = (r.pick(&[48, 64]), r.pick(&[32, 40]));
    let end = r.between(0.16, 0.24);
    let case = |seed: usize| {
        format!(
            "[case]\nkind = \"wake\"\npair = {{ from = \"circulation\", spacing_m = {b0:?}, circulation_m2_s = {gamma:?} }}\ncells = [8, {y}, {z}]\n\
             size = [0.8, 3.7, 2.1]\ncore_radius = 0.25\nreynolds = {:?}\nperturbation = 0.03\nseed = {seed}\ncirculation_radii_m = {radii}\n\
             [wake]\nend_tau = {end:?}\nevery_tau = 0.05\nplanes_tau = [0.1, {end:?}]\nplanes_x = [0.4]\nfields_tau = [{end:?}]\n[output]\nfields = []\nplanes = [\"netcdf\"]\n",
            (600.0 + 20.0 * b0).round()
        )
    };
    bench.write("w.toml", &case(5));
    if bench
        .must(ledger, &["wake", "w.toml", "--out", "w"])
        .is_none()
    {
        return;
    }
    let si = bench.csv(ledger, "w/wake.csv");
    let steps = bench.csv(ledger, "w/steps.csv");
    hold_steps(ledger, &steps);
    let v0 = gamma / (2.0 * PI * b0);
    let mut nc = bench.netcdf(ledger, "w/wake.nc");
    for name in &si.names {
        // A variable is called as its column less the unit, unless the unit has no tag of its own.
        let tags = ["_m2_s", "_m", "_hz"];
        let bare = tags.iter().find_map(|tag| name.strip_suffix(tag));
        let variable = bare
            .filter(|bare| nc.names().iter().any(|own| own == bare))
            .unwrap_or(name);
        if !nc.names().iter().any(|own| own == variable) {
            continue;
        }
        let (table, file) = (si.f(name), nc.f(variable));
        if file.len() == table.len() {
            for (a, c) in table.iter().zip(&file) {
                ledger.equal(
                    &format!("wake.nc: {variable}"),
                    *c,
                    *a,
                    2e-7 * a.abs() + 1e-12,
                );
            }
        }
    }
    let (tau, time) = (si.f("tau"), si.f("time_s"));
    for i in 0..si.len() {
        ledger.equal("wake.csv: tau", tau[i], (0.05 * i as f64).min(end), 1e-9);
        ledger.equal(
            "wake.csv: time_s",
            time[i],
            tau[i] * b0 / v0,
            1e-9 * time[i].abs(),
        );
        for side in ["left", "right"] {
            if let Some(name) = si.names.iter().find(|n| {
                n.starts_with("gamma")
                    && n.ends_with(&format!("{side}_m2_s"))
                    && !n.contains("opposite")
            }) {
                let g = si.f(name);
                ledger.equal(
                    &format!("wake.csv: gamma_ratio_{side}"),
                    si.f(&format!("gamma_ratio_{side}"))[i],
                    g[i] / g[0],
                    1e-9,
                );
            }
        }
        let modes: f64 = si
            .names
            .iter()
            .filter(|n| n.starts_with("energy_mode_"))
            .map(|n| si.f(n)[i])
            .sum();
        // The modes that are left out of the table are the short ones.
        let energy = si.f("energy_m4_s2")[i];
        ledger.equal("wake.csv: energy_m4_s2", energy, modes, 2e-3 * energy);
    }
    // The initial pair is a sum of vortices of (V1); Gamma(r) averaged over the radii that are asked for.
    let core = 0.25 * b0;
    let mean = (0..=20)
        .map(|k| low + (high - low) * k as f64 / 20.0)
        .map(|x| gamma * x * x / (x * x + core * core))
        .sum::<f64>()
        / 21.0;
    let name = si.names.iter().find(|n| {
        n.starts_with("gamma")
            && n.ends_with("left_m2_s")
            && !n.contains("opposite")
            && !n.contains("secondary")
    });
    if let Some(name) = name {
        let found = si.f(name)[0].abs();
        ledger.equal("wake.csv: gamma over the radii", found, mean, 0.12 * mean);
        let word = nc.text(name.trim_end_matches("_m2_s"), "long_name");
        let is_named = word.contains(&format!("{low:.1}"))
            || (name.contains("5_15") && radii == "[5.0, 15.0]");
        ledger.holds(
            "wake.nc: gamma says its radii",
            is_named,
            &format!("{name}: {word}, radii {radii}"),
        );
    }
    for file in ["w/wake.csv", "w/steps.csv"] {
        let text = std::fs::read_to_string(bench.folder.join(file)).unwrap_or_default();
        ledger.holds(
            "wake: seed of the files",
            text.contains("# seed: 5\n"),
            file,
        );
    }
    let other = bench.must(ledger, &["wake", "w.toml", "--seed", "7", "--out", "w7"]);
    let energies = bench.csv(ledger, "w7/wake.csv").f("energy_3d_m4_s2");
    ledger.holds(
        "wake: --seed",
        other.is_some() && energies != si.f("energy_3d_m4_s2"),
        "the same bits with another seed",
    );
    // A scene looks at the planes at the age that was asked for.
    bench.write(
        "p.toml",
        &format!(
            "flow = {{ kind = \"simulated\", planes = \"w/plane1\", age_tau = {end:?}, motion = \"frozen\" }}\n\
             scan = {{ range_min_m = 380.0, range_max_m = 440.0, elevation_min_rad = 0.05, elevation_max_rad = 0.06, \
             pulses_per_line = 1, outside_flow = {{ policy = \"mask\" }} }}\n"
        ),
    );
    let check = bench.run(&["check", "p.toml"]);
    ledger.holds(
        "wake: a plane at the age that was asked for",
        check.is_good,
        &check.stderr,
    );
    // A finished run has no earlier end.
    let ended = bench.run(&["wake", "w.toml", "--restart", "--end", "0.1", "--out", "w"]);
    let text = std::fs::read_to_string(bench.folder.join("w/case.toml")).unwrap_or_default();
    ledger.holds(
        "wake: an earlier end",
        !ended.is_good || !text.contains("end_tau = 0.1"),
        "rows beyond the end that case.toml states",
    );
}

/// A pair of vortices between slip walls with a scheme at a Courant number.
fn pair_case(scheme: &str, courant: f64, model: &str, end: f64, x: usize) -> String {
    format!(
        "[case]\nkind = \"vortex_pair\"\nreynolds = 1e6\ncore_radius = 0.12\nsticky_ground = false\ncells = [{x}, 48, 30]\n[time]\nend_s = {end:?}\nscheme = \"{scheme}\"\ncourant = {courant:?}\n\
         [solver]\nsubgrid = {{ model = \"{model}\" }}\n[output]\nfields = []\nplanes = []\n[checkpoint]\nwrite = false\n"
    )
}

/// What the time step does to the energy is told, or is little; a Courant number beyond the limit is refused.
pub(crate) fn hold_growth(r: &mut Random, bench: &Bench, ledger: &mut Ledger) {
    // The program chooses scheme and step; a weak model leaves the short waves to them.
    let (model, constant) = (r.pick(&["wale", "smagorinsky"]), r.log(0.005, 0.03));
    bench.write(
        "g.toml",
        &format!(
            "[case]\nkind = \"vortex_pair\"\nreynolds = 1e6\ncore_radius = 0.25\nperturbation = 0.3\nsticky_ground = false\ncells = [{}, 48, 30]\n\
             [time]\nend_s = 2.0\n[solver]\nsubgrid = {{ model = \"{model}\", constant = {constant:?} }}\n[output]\nfields = []\n[checkpoint]\nwrite = false\n",
            r.pick(&[8, 12, 16])
        ),
    );
    let ended = bench.run(&["flow", "g.toml", "--out", "g"]);
    let steps = bench.csv(ledger, "g/steps.csv");
    hold_steps(ledger, &steps);
    let half = steps.len() / 2;
    let sum = |name: &str| {
        steps.f(name)[half..]
            .iter()
            .filter(|v| v.is_finite())
            .sum::<f64>()
    };
    let fed = sum("energy_residual_m5_s3")
        / (sum("viscous_power_m5_s3") + sum("subgrid_power_m5_s3")).abs();
    let told = !ended.is_good || is_told(&ended);
    ledger.holds(
        "flow: what the step feeds is told",
        told || fed < 0.25,
        &format!(
            "{model} {constant}: {fed:.2} of what is taken is fed, no word: {}",
            ended.stderr.trim()
        ),
    );
    let energy = steps.f("kinetic_energy_m5_s2");
    let largest = energy.iter().fold(0.0_f64, |a, &e| a.max(e));
    ledger.holds(
        "flow: energy that nothing gave is told",
        told || largest < 1.0002 * energy[0],
        &format!(
            "{model} {constant}: {:.5} of the start",
            largest / energy[0]
        ),
    );
    // RK3 with slip walls has the linear limit sqrt(3)/1.5860.
    let limit = 3_f64.sqrt() / 1.586;
    for (share, is_stable) in [(0.9, true), (1.12, false)] {
        bench.write(
            "l.toml",
            &pair_case("runge_kutta3", share * limit, "none", 0.2, 1),
        );
        let check = bench.run(&["flow", "l.toml", "--check"]);
        let told = !check.is_good || is_told(&check);
        ledger.holds(
            "flow: Courant numbers of Runge-Kutta",
            is_stable || told,
            &format!(
                "{:.3} is beyond {limit:.3}: {}",
                share * limit,
                check.stdout.trim()
            ),
        );
        ledger.holds(
            "flow: Courant numbers that are right pass",
            !is_stable || check.is_good,
            &format!("{:.3}: {}", share * limit, check.stderr),
        );
    }
}

/// A warning or a note was printed.
fn is_told(ended: &Ended) -> bool {
    ["warning", "note"]
        .iter()
        .any(|word| ended.stderr.contains(word) || ended.stdout.contains(word))
}

/// A cavity of little Reynolds number: its steady energy whatever the step.
pub(crate) fn hold_cavity(r: &mut Random, bench: &Bench, ledger: &mut Ledger) {
    let reynolds = r.log(0.05, 1.0);
    let mut energy = |name: &str, time: &str| {
        let wall = "cells = 16, low_m = 0.0, high_m = 1.0, mapping = \"tanh_both\", stretch = 1.5, low_end = \"no_slip\", high_end = \"no_slip\"";
        bench.write(
            "c.toml",
            &format!(
                "[case]\nkind = \"free\"\nviscosity_m2_s = {:?}\ny = {{ {wall} }}\nz = {{ {wall}, high_velocity_m_s = [0.0, 1.0, 0.0] }}\n\
                 initial = {{ kind = \"uniform\", velocity_m_s = [0.0, 0.0, 0.0] }}\n[time]\nend_s = 1.0\n{time}[output]\nfields = []\n\
                 [checkpoint]\nwrite = false\n",
                1.0 / reynolds
            ),
        );
        let ended = bench.run(&["flow", "c.toml", "--out", name]);
        let steps = bench.csv(ledger, &format!("{name}/steps.csv"));
        let last = steps
            .f("kinetic_energy_m5_s2")
            .last()
            .copied()
            .unwrap_or(f64::NAN);
        (if ended.is_good { last } else { f64::NAN }, is_told(&ended))
    };
    let (right, _) = energy("fine", "step_s = 1e-3\nscheme = \"runge_kutta3\"\n");
    let (usual, told) = energy("usual", "longest_step_s = 0.02\n");
    ledger.holds(
        "flow: the default scheme and step of a creeping flow",
        told || (usual / right - 1.0).abs() < 2e-3,
        &format!("Reynolds number {reynolds}: energy {usual}, {right} with short steps, no word"),
    );
}
