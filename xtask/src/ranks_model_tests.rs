//! The model of the book for weak scaling on ranks: every rank is a machine of 64 cores with the same slab, and all ranks exchange halos and
//! lines that cross slabs. Nothing is hidden behind the work, as in the solver.

use crate::ranks::{PLANES, TURNS};
use crate::thread_ranks::on_threads;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use wakescope_les::cases::taylor_green_3d;
use wakescope_les::ranks::Ranks;
use wakescope_les::{Error, FlowSettings, SubgridModel, TimeScheme};

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

/// Planes that leave a slab in a stage, and in how many exchanges.
#[derive(Clone, Copy)]
struct Halos {
    planes: f64,
    exchanges: f64,
}

impl Halos {
    /// Three of the third component before the divergence; whole halos, eight planes, of the pressure and of the velocity.
    const PLAIN: Self = Self {
        planes: 3.0 + 4.0 * 8.0,
        exchanges: 3.0,
    };
    /// Before them four of the eddy viscosity and of each component of the small scales; four of each stress that acts across planes.
    const MULTISCALE: Self = Self {
        planes: PLANES,
        exchanges: 5.0,
    };
}

/// Time of a stage in which nothing is exchanged, and of turns and halos \[s\], on `ranks`.
fn stage_s(ranks: f64, halos: Halos) -> [f64; 3] {
    let [nx, ny, own] = SLAB;
    let work_s = nx * ny * own * CELL_S / CORES;
    if ranks == 1.0 {
        return [work_s, 0.0, 0.0];
    }
    let busiest = (nx / ranks).ceil() * ranks / nx;
    let bytes = 8.0 * nx * ny;
    let turns_s = TURNS * (ranks * MESSAGE_S + bytes * own * (1.0 - 1.0 / ranks) / BYTES_PER_S);
    let halos_s = 2.0 * halos.exchanges * MESSAGE_S + bytes * halos.planes / BYTES_PER_S;
    [work_s * (1.0 + LINES * (busiest - 1.0)), turns_s, halos_s]
}

/// Work of one rank over what a stage lasts.
fn efficiency(stage_s: [f64; 3], alone_s: f64) -> f64 {
    alone_s / stage_s.iter().sum::<f64>()
}

/// The table of the book.
fn table() -> String {
    let mut text = "| ranks | planes | turns, ms a stage | halos, ms a stage | efficiency | halos with the multiscale model | efficiency with it |\n\
                    |---|---|---|---|---|---|---|\n"
        .to_owned();
    let [alone_s, ..] = stage_s(1.0, Halos::PLAIN);
    for ranks in [1.0, 2.0, 4.0, 16.0, 64.0, 256.0, 1024.0] {
        let plain = stage_s(ranks, Halos::PLAIN);
        let model = stage_s(ranks, Halos::MULTISCALE);
        text += &format!(
            "| {ranks} | {} | {:.1} | {:.1} | {:.2} | {:.1} | {:.2} |\n",
            ranks * SLAB[2],
            1e3 * plain[1],
            1e3 * plain[2],
            efficiency(plain, alone_s),
            1e3 * model[2],
            efficiency(model, alone_s)
        );
    }
    text
}

/// Ranks that count what leaves them, in messages of more than `least` values.
#[derive(Debug)]
struct Counting {
    ranks: Arc<dyn Ranks>,
    least: usize,
    values: AtomicUsize,
    messages: AtomicUsize,
}

impl Counting {
    /// Values and messages so far.
    fn counts(&self) -> [usize; 2] {
        [&self.values, &self.messages].map(|count| count.load(Ordering::Relaxed))
    }
}

impl Ranks for Counting {
    fn rank(&self) -> usize {
        self.ranks.rank()
    }

    fn count(&self) -> usize {
        self.ranks.count()
    }

    fn all_to_all(
        &self,
        send: &[f64],
        to: &[usize],
        receive: &mut [f64],
        from: &[usize],
    ) -> Result<(), Error> {
        let leaving = to.iter().sum::<usize>() - to[self.rank()];
        if leaving > self.least {
            self.values.fetch_add(leaving, Ordering::Relaxed);
            self.messages.fetch_add(1, Ordering::Relaxed);
        }
        self.ranks.all_to_all(send, to, receive, from)
    }
}

#[test]
fn the_solver_sends_what_the_model_says() {
    let n = 24;
    for (subgrid, halos) in [
        (SubgridModel::None, Halos::PLAIN),
        (SubgridModel::MULTISCALE_WALE, Halos::MULTISCALE),
    ] {
        let sent = on_threads(2, |ranks| {
            let counting = Arc::new(Counting {
                ranks,
                least: n * n,
                values: 0.into(),
                messages: AtomicUsize::new(0),
            });
            let mut case = taylor_green_3d(n, 1600.0).unwrap();
            case.settings = FlowSettings {
                ranks: counting.clone(),
                scheme: TimeScheme::RungeKutta3,
                subgrid,
                ..case.settings
            };
            let (mut flow, _) = case.initial.start(case.mesh, case.settings).unwrap();
            let before = counting.counts();
            flow.step().unwrap();
            let after = counting.counts();
            [after[0] - before[0], after[1] - before[1]]
        });
        let stages = 3.0;
        // half of the slab of one rank leaves it in a turn
        let values = stages * (n * n) as f64 * (halos.planes + TURNS * n as f64 / 4.0);
        let messages = stages * (halos.exchanges + TURNS);
        assert_eq!(
            sent,
            vec![Some([values as usize, messages as usize]); 2],
            "{subgrid:?}"
        );
    }
}

#[test]
fn the_book_has_the_table_of_the_model() {
    let page = std::fs::read_to_string(crate::workspace::root().join("docs/src/ranks.md")).unwrap();
    assert!(
        page.contains(&table()),
        "docs/src/ranks.md lacks\n{}",
        table()
    );
}
