//! Random winds and aerosol of the scenes.

use super::random::Random;
use super::scene::Scene;

/// Keys of a flow and their values as TOML.
type Keys = Vec<(&'static str, String)>;

fn quoted(word: &str) -> String {
    format!("\"{word}\"")
}

fn number(value: f64) -> String {
    format!("{value:?}")
}

/// Aerosol of each kind.
pub(crate) fn atmosphere(r: &mut Random, s: &mut Scene) {
    match r.whole(0, 9) {
        0 | 1 => s
            .set(
                "atmosphere.profile.range_m",
                "[100.0, 400.0, 900.0, 2000.0]",
            )
            .set(
                "atmosphere.profile.backscatter_per_m_sr",
                format!(
                    "[1e-7, {:?}, {:?}, 1e-8]",
                    r.log(1e-8, 1e-6),
                    r.log(1e-8, 1e-6)
                ),
            )
            .set(
                "atmosphere.profile.extinction_per_m",
                format!("[7e-5, {:?}, 1e-4, 1e-5]", r.log(1e-5, 1e-3)),
            ),
        2 => s
            .word("atmosphere.aerosol.kind", "visibility")
            .number("atmosphere.aerosol.visibility_m", r.log(1e3, 1e5))
            .number("atmosphere.aerosol.lidar_ratio_sr", r.between(20.0, 80.0)),
        3 => layer(r, s),
        _ => s
            .number("atmosphere.backscatter_per_m_sr", r.log(1e-8, 1e-6))
            .number("atmosphere.extinction_per_m", r.log(1e-5, 5e-4)),
    };
}

/// A layer whose top is in or above the scan.
fn layer<'s>(r: &mut Random, s: &'s mut Scene) -> &'s mut Scene {
    s.word("atmosphere.aerosol.kind", "layer")
        .number(
            "atmosphere.aerosol.ground_backscatter_per_m_sr",
            r.log(1e-7, 3e-6),
        )
        .number("atmosphere.aerosol.scale_height_m", r.log(200.0, 5e3))
        .number("atmosphere.aerosol.top_m", r.log(20.0, 1e3))
        .number(
            "atmosphere.aerosol.above_backscatter_per_m_sr",
            r.log(1e-8, 3e-7),
        )
        .number("atmosphere.aerosol.step_m", r.log(5.0, 100.0))
        .number("atmosphere.aerosol.lidar_ratio_sr", r.between(20.0, 80.0))
}

/// A flow, and up to three that are added to it; some combinations are refused.
pub(crate) fn flow(r: &mut Random, s: &mut Scene) {
    let adds_wind = r.chance(0.2);
    let adds_eddies = r.chance(0.3);
    let (kind, keys) = match r.whole(0, 11) {
        0..=5 => ("vortex_pair", vortex_pair(r, adds_wind, adds_eddies)),
        6 => ("calm", Vec::new()),
        7 => ("uniform", uniform(r)),
        8 => ("wind", mean_wind(r)),
        9 => ("eddies", eddies(r, adds_wind)),
        _ => ("linear", linear(r)),
    };
    s.word("flow.kind", kind);
    for (key, value) in keys {
        s.set(&format!("flow.{key}"), value);
    }
    let mut added = Vec::new();
    if r.chance(0.2) {
        added.push(("uniform", uniform(r)));
    }
    if adds_wind {
        added.push(("wind", mean_wind(r)));
    }
    if adds_eddies {
        added.push(("eddies", eddies(r, adds_wind || kind == "wind")));
    }
    add(s, &added);
}

/// States the flows that are added to that of the scene.
pub(crate) fn add(s: &mut Scene, added: &[(&str, Keys)]) {
    let table = |(kind, keys): &(&str, Keys)| {
        let keys: String = keys
            .iter()
            .map(|(key, value)| format!(", {key} = {value}"))
            .collect();
        format!("{{ kind = \"{kind}\"{keys} }}")
    };
    if !added.is_empty() {
        let tables: Vec<String> = added.iter().map(table).collect();
        s.set("added_flows", format!("[{}]", tables.join(", ")));
    }
}

/// A pair of each motion.
fn vortex_pair(r: &mut Random, has_wind: bool, has_eddies: bool) -> Keys {
    let mut keys = vec![
        ("circulation_m2_s", number(r.log(100.0, 700.0))),
        ("spacing_m", number(r.between(20.0, 60.0))),
        ("core_radius_m", number(r.between(1.2, 5.0))),
        ("lateral_position_m", number(r.between(370.0, 420.0))),
        ("height_m", number(r.between(25.0, 60.0))),
        ("profile", quoted(r.pick(&["algebraic", "lamb_oseen"]))),
    ];
    if r.chance(0.5) && (!has_wind || r.chance(0.05)) {
        keys.push(("cross_wind_m_s", number(r.between(-5.0, 5.0))));
    }
    let motion = r.pick(&["frozen", "inviscid", "transported", "transported"]);
    keys.push(("motion", quoted(motion)));
    if motion == "transported" {
        keys.extend(transport(r, has_eddies));
        if r.chance(0.2) {
            let (x_m, speed_m_s) = (r.between(10.0, 600.0), r.between(60.0, 90.0));
            keys.push((
                "aircraft",
                format!("{{ x_m = {x_m:?}, speed_m_s = {speed_m_s:?} }}"),
            ));
            return keys;
        }
    }
    if motion != "frozen" {
        keys.push(("age_tau", number(r.between(0.0, 3.0))));
    }
    keys
}

/// How a pair decays and moves.
fn transport(r: &mut Random, has_eddies: bool) -> Keys {
    let mut keys = Vec::new();
    match r.whole(0, 3) {
        0 => {}
        1 => {
            let (slow, fast) = (r.between(0.0, 0.2), r.between(0.0, 1.0));
            let law = format!("{{ law = \"two_phase\", slow = {slow:?}, fast = {fast:?} }}");
            keys.push(("decay", law));
        }
        _ => {
            let rate = r.between(0.0, 1.0);
            keys.push((
                "decay",
                format!("{{ law = \"sarpkaya\", rate = {rate:?} }}"),
            ));
        }
    }
    match r.whole(0, 2) {
        0 => keys.push(("lifetime_tau", number(r.between(0.5, 5.0)))),
        1 => keys.push(("dissipation_m2_s3", number(r.log(1e-6, 2e-2)))),
        _ => {}
    }
    if r.chance(0.5) {
        keys.push(("buoyancy_per_s", number(r.between(0.0, 0.05))));
    }
    if r.chance(0.5) {
        keys.push(("rebound", "true".into()));
    }
    if has_eddies && r.chance(0.3) {
        keys.push(("meander", "true".into()));
    }
    keys
}

fn uniform(r: &mut Random) -> Keys {
    let vertical_m_s = if r.chance(0.5) {
        0.0
    } else {
        r.between(-1.0, 1.0)
    };
    vec![
        ("lateral_m_s", number(r.between(-10.0, 10.0))),
        ("vertical_m_s", number(vertical_m_s)),
    ]
}

fn linear(r: &mut Random) -> Keys {
    let mut gradient = || r.between(-0.02, 0.02);
    let gradients = format!("[0.0, {:?}, {:?}]", gradient(), gradient());
    vec![
        (
            "velocity_m_s",
            format!("[1.0, {:?}, 0.1]", r.between(-5.0, 5.0)),
        ),
        ("gradient_v_per_s", gradients),
        (
            "acceleration_m_s2",
            format!("[0.0, {:?}, 0.0]", r.between(-3.0, 3.0)),
        ),
    ]
}

/// Turbulence, carried by a mean wind where there is one.
pub(crate) fn eddies(r: &mut Random, has_wind: bool) -> Keys {
    let outer_m = r.log(20.0, 150.0);
    let mut keys = vec![
        ("dissipation_m2_s3", number(r.log(1e-5, 2e-2))),
        ("outer_scale_m", number(outer_m)),
        ("smallest_m", number(r.log(1.0, 0.2 * outer_m))),
        ("modes", r.whole(330, 700).to_string()),
        ("evaluation", quoted(r.pick(&["levels", "levels", "all"]))),
        ("ground", quoted(r.pick(&["open", "blocked"]))),
        ("decorrelation", quoted(r.pick(&["none", "sweeping"]))),
        ("realisations", quoted(r.pick(&["one", "each"]))),
    ];
    if r.chance(0.3) {
        keys.push(("kolmogorov_constant", number(r.between(1.3, 1.7))));
    }
    if r.chance(if has_wind { 0.7 } else { 0.02 }) {
        keys.push(("carried_at_m", number(r.between(5.0, 100.0))));
    }
    keys
}

/// A mean wind over the height, of each law.
fn mean_wind(r: &mut Random) -> Keys {
    match r.whole(0, 3) {
        0 => vec![
            ("speed_m_s", number(r.between(0.0, 12.0))),
            ("toward_rad", number(r.between(0.0, 6.0))),
            ("roughness_m", number(r.log(1e-3, 0.3))),
            ("displacement_m", number(r.between(0.0, 5.0))),
        ],
        1 => vec![
            ("friction_velocity_m_s", number(r.between(0.1, 0.8))),
            ("roughness_m", number(r.log(1e-3, 0.3))),
        ],
        2 => vec![
            ("profile", quoted("power")),
            ("exponent", number(r.between(0.0, 0.4))),
            ("head_wind_m_s", number(r.between(-8.0, 8.0))),
            ("cross_wind_m_s", number(r.between(-8.0, 8.0))),
        ],
        _ => {
            // Kinks below the scan: the sums of both sides are good to 1e-6 where the wind is smooth.
            let first_m = r.between(0.0, 4.0);
            let second_m = first_m + r.between(1.0, 6.0);
            let (first_m_s, second_m_s) = (r.between(0.0, 5.0), r.between(0.0, 9.0));
            vec![
                ("profile", quoted("table")),
                ("height_m", format!("[{first_m:?}, {second_m:?}, 300.0]")),
                (
                    "speeds_m_s",
                    format!("[{first_m_s:?}, {second_m_s:?}, 9.0]"),
                ),
                (
                    "towards_rad",
                    format!("[1.0, {:?}, 2.0]", r.between(0.0, 6.0)),
                ),
            ]
        }
    }
}
