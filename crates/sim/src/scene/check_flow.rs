//! What the winds of a scene may say, that of `[flow]` and those that are added to it.
//! Check: each limit is broken once.

use super::{FieldFlow, Flow, SimulatedFlow, VortexLines, VortexMotion};
use crate::keys::{Checker, Problem};
use std::f64::consts::TAU;

/// The limits of a wind whose table is at `at`.
pub(super) fn check_flow(flow: &Flow, at: &str, c: &mut Checker<'_>) {
    let key = |name: &str| format!("{at}.{name}");
    match flow {
        Flow::Calm {} => {}
        Flow::Uniform { lateral_m_s, vertical_m_s } => {
            c.within(&key("lateral_m_s"), *lateral_m_s, -1e3, 1e3, "m/s");
            c.within(&key("vertical_m_s"), *vertical_m_s, -1e3, 1e3, "m/s");
        }
        Flow::Linear(wind) => {
            let lists = [
                ("velocity_m_s", wind.velocity_m_s, 1e3, "m/s"),
                ("gradient_u_per_s", wind.gradient_u_per_s, 1e3, "1/s"),
                ("gradient_v_per_s", wind.gradient_v_per_s, 1e3, "1/s"),
                ("gradient_w_per_s", wind.gradient_w_per_s, 1e3, "1/s"),
                ("acceleration_m_s2", wind.acceleration_m_s2, 1e3, "m/s^2"),
            ];
            for (name, values, most, unit) in lists {
                for value in values {
                    c.within(&key(name), value, -most, most, unit);
                }
            }
        }
        Flow::VortexLines(lines) => check_lines(lines, at, c),
        Flow::Simulated(flow) => check_simulated(flow, at, c),
        Flow::Fields(flow) => check_fields(flow, at, c),
        Flow::VortexPair(p) => {
            c.within(&key("circulation_m2_s"), p.circulation_m2_s, 0.0, 1e5, "m^2/s");
            c.within(&key("spacing_m"), p.spacing_m, 1e-2, 1e4, "m");
            c.within(&key("core_radius_m"), p.core_radius_m, 1e-3, 1e3, "m");
            c.within(&key("lateral_position_m"), p.lateral_position_m, -1e5, 1e5, "m");
            c.within(&key("height_m"), p.height_m, 1e-2, 1e4, "m");
            c.within(&key("cross_wind_m_s"), p.cross_wind_m_s, -1e3, 1e3, "m/s");
            c.within(&key("age_tau"), p.age_tau, 0.0, 1e3, "");
            c.require(
                p.age_tau == 0.0 || p.motion == VortexMotion::Inviscid,
                &key("age_tau"),
                p.age_tau,
                "0 for a pair at rest; an age needs flow.motion = \"inviscid\"",
            );
            if let Some(aircraft) = p.aircraft {
                c.within(&key("aircraft.speed_m_s"), aircraft.speed_m_s, 1.0, 1e3, "m/s");
                c.within(&key("aircraft.x_m"), aircraft.x_m, -1e6, 1e6, "m");
                let allowed = format!("0 with {at}.aircraft, which says how old the wake is at each place");
                c.require(p.age_tau == 0.0, &key("age_tau"), p.age_tau, allowed);
            }
        }
    }
}

fn check_lines(lines: &VortexLines, at: &str, c: &mut Checker<'_>) {
    let key = |name: &str| format!("{at}.{name}");
    let (count, circulations) = (lines.nodes_m.len(), lines.circulation_m2_s.len());
    let fits = (1..=1000).contains(&count);
    c.require(fits, &key("nodes_m"), format!("a list of {count}"), "a list of 1 to 1000 vortices");
    let allowed = format!("as many values as {at}.nodes_m has vortices, {count}");
    c.require(circulations == count, &key("circulation_m2_s"), format!("a list of {circulations}"), allowed);
    for value in lines.nodes_m.iter().flatten().flatten() {
        c.within(&key("nodes_m"), *value, -1e7, 1e7, "m");
    }
    for value in &lines.circulation_m2_s {
        c.within(&key("circulation_m2_s"), *value, -1e5, 1e5, "m^2/s");
    }
    c.within(&key("core_radius_m"), lines.core_radius_m, 1e-3, 1e3, "m");
    c.within(&key("axial_deficit_m_s"), lines.axial_deficit_m_s, -1e3, 1e3, "m/s");
    let axial = lines.endless || lines.axial_deficit_m_s == 0.0;
    let allowed = format!("0 with {at}.endless = false: the middle of a polyline has no speed of its own");
    c.require(axial, &key("axial_deficit_m_s"), lines.axial_deficit_m_s, allowed);
    if fits
        && c.is_good()
        && let Err(e) = crate::setup::wind::vortex_lines(lines)
    {
        c.refuse(&key("nodes_m"), "", e.to_string());
    }
}

fn check_simulated(flow: &SimulatedFlow, at: &str, c: &mut Checker<'_>) {
    let key = |name: &str| format!("{at}.{name}");
    if flow.planes.is_empty() {
        let allowed = "a file of cross-planes, or the beginning of the names of numbered ones";
        c.refuse(&key("planes"), Problem::ABSENT, allowed);
    }
    if let Some(time_s) = flow.time_s {
        c.within(&key("time_s"), time_s, -1e9, 1e9, "s");
        c.require(flow.age_tau.is_none(), &key("time_s"), time_s, "absent beside flow.age_tau");
    }
    if let Some(age_tau) = flow.age_tau {
        c.within(&key("age_tau"), age_tau, -1e9, 1e9, "");
    }
    c.within(&key("lateral_position_m"), flow.lateral_position_m, -1e5, 1e5, "m");
    c.within(&key("length_unit_m"), flow.length_unit_m, 1e-6, 1e6, "m");
    c.within(&key("velocity_unit_m_s"), flow.velocity_unit_m_s, 1e-6, 1e6, "m/s");
}

fn check_fields(flow: &FieldFlow, at: &str, c: &mut Checker<'_>) {
    let key = |name: &str| format!("{at}.{name}");
    if flow.files.is_empty() {
        c.refuse(&key("files"), Problem::ABSENT, "a file of fields, or the beginning of the names of numbered ones");
    }
    if let Some(time_s) = flow.time_s {
        c.within(&key("time_s"), time_s, -1e9, 1e9, "s");
    }
    for value in flow.origin_m {
        c.within(&key("origin_m"), value, -1e7, 1e7, "m");
    }
    c.within(&key("rotation_rad"), flow.rotation_rad, -TAU, TAU, "rad");
    c.within(&key("length_unit_m"), flow.length_unit_m, 1e-6, 1e6, "m");
    c.within(&key("velocity_unit_m_s"), flow.velocity_unit_m_s, 1e-6, 1e6, "m/s");
    if let Some(backscatter) = &flow.backscatter {
        if backscatter.name.is_empty() {
            c.refuse(
                &key("backscatter.name"),
                Problem::ABSENT,
                "the name of a variable of the file over (time, z, y, x)",
            );
        }
        c.within(&key("backscatter.unit_per_m_sr"), backscatter.unit_per_m_sr, 0.0, 1e6, "1/(m sr)");
    }
}
