//! Table 1: ICAO separations, as distances and as times at approach speed.

use super::context::*;

const NAUTICAL_MILE_M: f64 = 1852.0;
const APPROACH_SPEED_M_S: f64 = 70.0;

/// Leader, follower, separation in nautical miles, delay as the chapter prints it in seconds.
const ROWS: [(&str, &str, f64, f64); 4] = [
    ("heavy", "heavy", 4.0, 106.0),
    ("heavy", "medium", 5.0, 132.0),
    ("heavy", "light", 6.0, 159.0),
    ("medium", "light", 5.0, 132.0),
];

pub(super) fn make(context: &Context) -> Result<Rendered, Failure> {
    let mut measured = Vec::new();
    let mut pass = true;
    for (.., miles, chapter_s) in ROWS {
        measured.push(format!("{:.1}", delay_s(miles)));
        // The chapter prints whole seconds.
        pass &= (delay_s(miles) - chapter_s).abs() <= 0.5;
    }
    let table = Table::new()
        .text("leader", column(&ROWS, |r| r.0))
        .text("follower", column(&ROWS, |r| r.1))
        .float("separation_m", column(&ROWS, |r| r.2 * NAUTICAL_MILE_M))
        .float("delay_s", column(&ROWS, |r| delay_s(r.2)))
        .float("delay_chapter_s", column(&ROWS, |r| r.3));
    let parameters = format!("approach_speed_m_s = {APPROACH_SPEED_M_S:?}\n");
    let mut out = Rendered::of_table(&table, &context.provenance_of_formula(&parameters))?;
    out.claims.push(Claim::exact(
        "T1",
        format!("{} s", measured.join(", ")),
        pass,
    ));
    Ok(out)
}

/// The time that a separation needs at approach speed.
fn delay_s(miles: f64) -> f64 {
    miles * NAUTICAL_MILE_M / APPROACH_SPEED_M_S
}
