//! What the winds of a scene may say, that of `[flow]` and those that are added to it.
//! Check: each limit is broken once.

use super::{Flow, VortexLines, VortexMotion};
use crate::keys::{Checker, Problem};

/// The limits of a wind whose table is at `at`.
pub(super) fn check_flow(flow: &Flow, at: &str, c: &mut Checker<'_>) {
    let key = |name: &str| format!("{at}.{name}");
    match flow {
        Flow::Calm {} | Flow::Uniform { .. } | Flow::Linear(_) => {}
        Flow::VortexLines(lines) => check_lines(lines, at, c),
        Flow::Simulated(flow) => {
            if flow.planes.is_empty() {
                let allowed = "a file of cross-planes, or the beginning of the names of numbered ones";
                c.refuse(&key("planes"), Problem::ABSENT, allowed);
            }
            if let Some(time_s) = flow.time_s {
                c.require(flow.age_tau.is_none(), &key("time_s"), time_s, "absent beside flow.age_tau");
            }
        }
        Flow::Fields(flow) => {
            if flow.files.is_empty() {
                let allowed = "a file of fields, or the beginning of the names of numbered ones";
                c.refuse(&key("files"), Problem::ABSENT, allowed);
            }
            if flow.backscatter.as_ref().is_some_and(|carried| carried.name.is_empty()) {
                let allowed = "the name of a variable of the file over (time, z, y, x)";
                c.refuse(&key("backscatter.name"), Problem::ABSENT, allowed);
            }
        }
        Flow::VortexPair(p) => {
            let key = key("age_tau");
            let allowed = "0 for a pair at rest; an age needs flow.motion = \"inviscid\"";
            c.require(p.age_tau == 0.0 || p.motion == VortexMotion::Inviscid, &key, p.age_tau, allowed);
            let allowed = format!("0 with {at}.aircraft, which says how old the wake is at each place");
            c.require(p.age_tau == 0.0 || p.aircraft.is_none(), &key, p.age_tau, allowed);
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
