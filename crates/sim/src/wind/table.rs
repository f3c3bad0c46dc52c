//! The table of winds, the object of their covariances, and a line for each window.
//!
//! Check: the header in the tests of the program.

use super::rows::{Flag, WindRow};
use super::{WindOptions, WindProfiles};
use crate::io::{Table, UtcTime};
use crate::quantities::measured;
#[cfg(feature = "cli")]
use serde_json::{Value, json};
use wakescope_estimate::Measured;

/// A number of a row with its standard deviation.
type Column = (&'static str, &'static str, fn(&WindRow) -> Measured);

/// Components of the wind: name, unit.
const COMPONENTS: [Column; 5] = [
    ("east", "m_s", |row| row.east_m_s),
    ("north", "m_s", |row| row.north_m_s),
    ("up", "m_s", |row| row.up_m_s),
    ("along", "m_s", |row| row.along_m_s),
    ("radial", "m_s", |row| row.radial_m_s),
];

/// What follows from them.
const DERIVED: [Column; 2] = [
    ("speed", "m_s", |row| row.speed_m_s),
    ("from", "deg", |row| row.from_deg),
];

/// The date of a time; nothing without one.
pub(super) fn date(reference: Option<UtcTime>, time_s: f64) -> String {
    let date = reference.filter(|_| time_s.is_finite());
    date.map_or_else(String::new, |date| date.after_s(time_s).to_string())
}

/// The flags of a row in one text.
fn flags(flags: &[Flag]) -> String {
    let names: Vec<&str> = flags.iter().map(|flag| flag.name()).collect();
    names.join(" ")
}

/// The table: a row for each window and height; what is not determined is empty.
#[must_use]
pub fn table(profiles: &WindProfiles) -> Table {
    let rows = &profiles.rows;
    let dates = |of: fn(&WindRow) -> f64| {
        let dates = rows.iter().map(|row| date(profiles.reference, of(row)));
        dates.collect::<Vec<_>>()
    };
    let numbers = |of: fn(&WindRow) -> f64| rows.iter().map(of).collect::<Vec<_>>();
    let mut table = Table::new()
        .int("window", rows.iter().map(|row| row.window as i64))
        .text("start_utc", dates(|row| row.start_s))
        .text("end_utc", dates(|row| row.end_s))
        .float("height_m", numbers(|row| row.height_m))
        .text("kind", rows.iter().map(|row| row.kind.name()))
        .float("azimuth_deg", numbers(|row| row.azimuth_deg))
        .float("elevation_deg", numbers(|row| row.elevation_deg));
    for (name, unit, of) in COMPONENTS {
        table = table.float(
            &format!("{name}_{unit}"),
            rows.iter().map(|row| of(row).value),
        );
    }
    for (name, unit, of) in COMPONENTS {
        table = table.float(
            &format!("{name}_std_{unit}"),
            rows.iter().map(|row| of(row).std),
        );
    }
    for (name, unit, of) in DERIVED {
        table = table
            .float(
                &format!("{name}_{unit}"),
                rows.iter().map(|row| of(row).value),
            )
            .float(
                &format!("{name}_std_{unit}"),
                rows.iter().map(|row| of(row).std),
            );
    }
    table
        .float("edr_m23_s", numbers(|row| row.edr_m23_s))
        .float("edr_low_m23_s", numbers(|row| row.edr_low_m23_s))
        .float("edr_high_m23_s", numbers(|row| row.edr_high_m23_s))
        .float("dissipation_m2_s3", numbers(WindRow::dissipation_m2_s3))
        .float("outer_scale_m", numbers(|row| row.outer_scale_m))
        .float("noise_std_m_s", numbers(|row| row.noise_std_m_s))
        .float("residual_std_m_s", numbers(|row| row.residual_std_m_s))
        .int("cells", rows.iter().map(|row| row.cells as i64))
        .float("good_cells", numbers(|row| row.good_cells))
        .float("bad_share", numbers(|row| row.bad_fraction))
        .float("likelihood", numbers(|row| row.likelihood))
        .text("flags", rows.iter().map(|row| flags(&row.flags)))
}

/// Most heights of a window whose winds are printed.
const MOST_PRINTED: usize = 30;

/// What a command prints of winds: those of a window of few heights, how many heights have one, and why others have none.
#[must_use]
pub fn summary(profiles: &WindProfiles) -> String {
    let count = |flag: Flag| {
        profiles
            .rows
            .iter()
            .filter(|row| row.flags.contains(&flag))
            .count()
    };
    let all = profiles.rows.len();
    let noise = count(Flag::Noise);
    let undetermined = count(Flag::Undetermined);
    let impossible = count(Flag::VerticalImpossible);
    let found = all - noise - undetermined - impossible;
    let mut text = profile(&profiles.rows);
    text += &format!(
        "{found} of {all} heights have a wind; {noise} are noise, the directions do not determine {undetermined}\n"
    );
    if impossible > 0 {
        text += &format!(
            "{impossible} have no wind since it would have a vertical component beyond 30 m/s: velocities beyond the Nyquist velocity, or bad ones\n"
        );
    }
    if count(Flag::WindAssumed) > 0 {
        text += "the wind across the beam is not known: 5 m/s are assumed for the standard errors; --wind E,N or --wind wind.csv gives it\n";
    }
    if count(Flag::CrossWindUnknown) > 0 {
        text += "the wind across the plane of the scan is not known: EDR is too high if it is strong; --wind E,N or --wind wind.csv gives it\n";
    }
    if let Some(row) = profiles.rows.iter().find(|row| row.has_wind())
        && row.kind == super::Kind::Radial
    {
        text += "all beams have one direction: they show the wind along it alone\n";
    }
    text
}

/// A line for each height with a wind, of one window with few of them.
fn profile(rows: &[WindRow]) -> String {
    let mut text = String::new();
    let is_one = rows.iter().all(|row| row.window == rows[0].window);
    if !is_one || rows.len() > MOST_PRINTED {
        return text;
    }
    for row in rows.iter().filter(|row| row.has_wind()) {
        let mut components = Vec::new();
        for (name, wind_m_s) in row.components() {
            components.push(format!("{name} {}", measured(wind_m_s, 2)));
        }
        text += &format!(
            "height {:.1} m: {} m/s",
            row.height_m,
            components.join(", ")
        );
        if row.edr_m23_s.is_finite() {
            text += &format!(
                ", EDR {:.3} ({:.3} to {:.3}) m^(2/3)/s",
                row.edr_m23_s, row.edr_low_m23_s, row.edr_high_m23_s
            );
        }
        text.push('\n');
    }
    text
}

/// The winds with the covariances of their components, the probabilities of the outer scales and the options.
#[cfg(feature = "cli")]
#[must_use]
pub fn json(profiles: &WindProfiles, options: &WindOptions) -> Value {
    let mut rows = Vec::with_capacity(profiles.rows.len());
    for row in &profiles.rows {
        let mut object = json!({
            "window": row.window, "start_utc": date(profiles.reference, row.start_s), "end_utc": date(profiles.reference, row.end_s),
            "height_m": row.height_m, "kind": row.kind.name(), "flags": row.flags.iter().map(|flag| flag.name()).collect::<Vec<_>>(),
            "edr_m23_s": row.edr_m23_s, "edr_low_m23_s": row.edr_low_m23_s, "edr_high_m23_s": row.edr_high_m23_s,
        });
        if row.has_wind() {
            let mut wind = serde_json::Map::new();
            for (name, value) in row.components() {
                wind.insert(format!("{name}_m_s"), json!(value.value));
            }
            object["wind"] = Value::Object(wind);
            let covariance = row.covariance_m2_s2.rows().into_iter();
            object["covariance_m2_s2"] = covariance.map(|row| json!(row.to_vec())).collect();
        }
        rows.push(object);
    }
    let outer_scales = profiles.outer_scales.iter();
    let outer_scales: Vec<Value> = outer_scales
        .map(|(outer_scale_m, p)| json!({ "outer_scale_m": outer_scale_m, "probability": p }))
        .collect();
    json!({
        "options": {
            "gate_std_m": options.gate_std_m, "kind": options.kind.map(|kind| kind.name()),
            "height_step_m": options.height_step_m, "layer_m": options.layer_m, "outer_scale_m": options.outer_scale_m,
        },
        "outer_scales": outer_scales, "winds": rows,
    })
}

#[cfg(not(feature = "cli"))]
const _: fn(&WindOptions) = |_| {};
