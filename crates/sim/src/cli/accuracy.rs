//! `wakescope check --accuracy`: the cheapest settings for an error, as text and as JSON.

use crate::plan::Plan;
use crate::plan::accuracy::Proposal;
use serde_json::{Value, json};

/// A share, such as `3%` or `0.03`.
pub(super) fn share(text: &str) -> Result<f64, String> {
    let (number, unit) = text.strip_suffix('%').map_or((text, 1.0), |number| (number, 0.01));
    let value = number.trim().parse::<f64>().map(|x| x * unit).unwrap_or(f64::NAN);
    match (1e-6..=1.0).contains(&value) {
        true => Ok(value),
        false => Err("must be a share from 0.0001% to 100%, such as 3% or 0.03".into()),
    }
}

/// One line a key, and what the lines rest on.
pub(super) fn as_text(plan: &Plan, found: &[Proposal], target: f64) -> String {
    let mut out = format!(
        "settings for an error of {} %, as it is {:.3} s of one core:\n",
        per_cent(target),
        plan.total().core_s
    );
    for p in found {
        let line = match &p.proposed {
            Some((value, measured)) => format!(
                "{value} (now {}): error {} % +- {} %, {}",
                p.now,
                per_cent(measured.error),
                per_cent(measured.standard_error),
                p.core_s
                    .map_or("which the rest of the scene does not allow".into(), |s| format!("the run then {s:.3} s"))
            ),
            None => format!("no measured value reaches it: keep {} or take a finer one", p.now),
        };
        out += &format!("  {:<36} {line}\n", p.key);
    }
    if found.is_empty() {
        out += "  nothing was measured of this scene's keys: periodogram accumulation and phase screens were\n";
    }
    out + "measured one key at a time on Table 2's scene (cargo xtask work-precision); errors add up as squares\n"
}

/// The same as JSON.
pub(super) fn as_json(found: &[Proposal], target: f64) -> Value {
    let one = |p: &Proposal| {
        let of = p.proposed.as_ref();
        json!({
            "key": p.key, "now": p.now, "proposed": of.map(|(value, _)| value), "error": of.map(|(_, m)| m.error),
            "standard_error": of.map(|(_, m)| m.standard_error), "core_s": p.core_s,
        })
    };
    json!({ "target": target, "settings": found.iter().map(one).collect::<Vec<_>>() })
}

/// Two digits of a share in per cent.
fn per_cent(share: f64) -> String {
    let value = 100.0 * share;
    if value == 0.0 || value >= 1.0 { format!("{value:.1}") } else { format!("{value:.1e}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_read_with_and_without_the_sign_and_others_are_refused() {
        assert_eq!((share("3%"), share("0.03"), share("100 %")), (Ok(0.03), Ok(0.03), Ok(1.0)));
        for bad in ["", "%", "0", "-3%", "101%", "nan", "three"] {
            assert!(share(bad).is_err(), "{bad}");
        }
    }
}
