//! Weak scaling of a flow on ranks by a model: every rank, a machine of 64 cores, has the same slab, and all ranks exchange
//! halos and lines that cross slabs. Nothing is hidden behind the work, as in the solver. No measurement.

/// Cells of a rank: its planes lie across the last axis.
const SLAB: [f64; 3] = [512.0, 512.0, 64.0];
/// Work on a cell in a stage by one core, with all others at work beside it \[s\].
const CELL_S: f64 = 0.4e-6;
const CORES: f64 = 64.0;
/// Part of the work that belongs to lines along the last axis, which at most one rank for each place of the first axis has.
const LINES: f64 = 0.1;
/// Between two machines: time of a message, and bytes in a second.
const MESSAGE_S: f64 = 2e-6;
const BYTES_PER_S: f64 = 1e10;
/// Planes that leave a rank in a stage, and exchanges of them, without and with the multiscale model.
const HALOS: [(f64, f64); 2] = [(24.0, 3.0), (43.0, 5.0)];

/// Time of a stage in which nothing is exchanged, and of turns and halos \[s\], on `ranks`.
fn stage_s(ranks: f64, (planes, exchanges): (f64, f64)) -> [f64; 3] {
    let [nx, ny, own] = SLAB;
    let work_s = nx * ny * own * CELL_S / CORES;
    if ranks == 1.0 {
        return [work_s, 0.0, 0.0];
    }
    let busiest = (nx / ranks).ceil() * ranks / nx;
    let bytes = 8.0 * nx * ny;
    let turns_s = 2.0 * (ranks * MESSAGE_S + bytes * own * (1.0 - 1.0 / ranks) / BYTES_PER_S);
    let halos_s = 2.0 * exchanges * MESSAGE_S + bytes * planes / BYTES_PER_S;
    [work_s * (1.0 + LINES * (busiest - 1.0)), turns_s, halos_s]
}

/// The table of the book.
pub(crate) fn table() -> String {
    let mut text =
        "| ranks | planes | turns, ms a stage | halos, ms a stage | efficiency | with the multiscale model |\n\
                    |---|---|---|---|---|---|\n"
            .to_owned();
    for ranks in [1.0, 2.0, 4.0, 16.0, 64.0, 256.0, 1024.0] {
        let [plain, model] = HALOS.map(|halos| stage_s(ranks, halos));
        let efficiency = |stage: [f64; 3]| stage_s(1.0, HALOS[0])[0] / stage.iter().sum::<f64>();
        text += &format!(
            "| {ranks} | {} | {:.1} | {:.1} | {:.2} | {:.2} |\n",
            ranks * SLAB[2],
            1e3 * plain[1],
            1e3 * plain[2],
            efficiency(plain),
            efficiency(model)
        );
    }
    text
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_book_has_the_table_of_the_model() {
        let page = std::fs::read_to_string(crate::workspace::root().join("docs/src/ranks.md")).unwrap();
        assert!(page.contains(&super::table()), "docs/src/ranks.md lacks\n{}", super::table());
    }
}
