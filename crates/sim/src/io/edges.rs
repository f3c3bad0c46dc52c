//! The ends of an axis as a text attribute, so that who reads planes back knows the walls and periods of the flow.
//!
//! `periodic 250.0`; or two of `open`, `slip_wall 0.0` and `no_slip_wall 0.0 0.0 0.0 0.0` (position, then the velocity of the
//! wall), for the low and the high end, with a comma between. Check: every form comes back.

use wakescope_les::winds::{Edges, Side};

/// The text of an axis' ends \[m, m/s\].
pub(crate) fn to_text(edges: Edges) -> String {
    match edges {
        Edges::Periodic { period_m } => format!("periodic {period_m:?}"),
        Edges::Bounded { low, high } => format!("{}, {}", side_text(low), side_text(high)),
    }
}

fn side_text(side: Side) -> String {
    match side {
        Side::Open => "open".to_owned(),
        Side::SlipWall { position_m } => format!("slip_wall {position_m:?}"),
        Side::NoSlipWall {
            position_m,
            velocity_m_s: [u, v, w],
        } => {
            format!("no_slip_wall {position_m:?} {u:?} {v:?} {w:?}")
        }
    }
}

/// The ends of an axis from their text; `None` for any other text.
pub(crate) fn from_text(text: &str) -> Option<Edges> {
    if let Some(period) = text.strip_prefix("periodic ") {
        return Some(Edges::Periodic {
            period_m: period.trim().parse().ok()?,
        });
    }
    let (low, high) = text.split_once(',')?;
    Some(Edges::Bounded {
        low: side(low)?,
        high: side(high)?,
    })
}

fn side(text: &str) -> Option<Side> {
    let mut words = text.split_whitespace();
    let kind = words.next()?;
    let numbers: Vec<f64> = words.map(str::parse).collect::<Result<_, _>>().ok()?;
    match (kind, &numbers[..]) {
        ("open", []) => Some(Side::Open),
        ("slip_wall", &[position_m]) => Some(Side::SlipWall { position_m }),
        ("no_slip_wall", &[position_m, u, v, w]) => Some(Side::NoSlipWall {
            position_m,
            velocity_m_s: [u, v, w],
        }),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_form_comes_back_and_others_are_none() {
        let ground = Side::NoSlipWall {
            position_m: -0.0,
            velocity_m_s: [0.1 + 0.2, 1e-300, -3.0],
        };
        for edges in [
            Edges::Periodic { period_m: 250.1 },
            Edges::Bounded {
                low: Side::Open,
                high: Side::SlipWall {
                    position_m: 1.0 / 3.0,
                },
            },
            Edges::Bounded {
                low: ground,
                high: Side::Open,
            },
        ] {
            assert_eq!(from_text(&to_text(edges)), Some(edges));
        }
        for text in [
            "",
            "periodic",
            "open",
            "open, wall 3.0",
            "open, slip_wall",
            "slip_wall 1.0 2.0, open",
        ] {
            assert_eq!(from_text(text), None, "{text}");
        }
    }
}
