//! Threads as ranks, for the tests of this crate and of those that include the file: what runs on
//! many machines, on one without MPI.

use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

use wakescope_les::{Error, ranks::Ranks};

/// One of several threads that share a flow.
#[derive(Debug)]
struct ThreadRanks {
    rank: usize,
    office: Arc<Office>,
}

#[derive(Debug)]
struct Office {
    mail: Mutex<Mail>,
    news: Condvar,
}

#[derive(Debug)]
struct Mail {
    /// Messages that wait, `[to][from]`.
    boxes: Vec<Vec<VecDeque<Vec<f64>>>>,
    has_left: Vec<bool>,
}

impl ThreadRanks {
    /// `count` ranks, one for each thread.
    fn new(count: usize) -> Vec<Self> {
        let boxes = (0..count).map(|_| vec![VecDeque::new(); count]).collect();
        let mail = Mutex::new(Mail {
            boxes,
            has_left: vec![false; count],
        });
        let office = Arc::new(Office {
            mail,
            news: Condvar::new(),
        });
        (0..count)
            .map(|rank| Self {
                rank,
                office: office.clone(),
            })
            .collect()
    }

    fn mail(&self) -> MutexGuard<'_, Mail> {
        self.office
            .mail
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
    }
}

/// Runs `work` on `count` threads as ranks and returns what each of them did, or `None` for one
/// that panicked.
pub(crate) fn on_threads<T: Send>(
    count: usize,
    work: impl Fn(Arc<dyn Ranks>) -> T + Sync,
) -> Vec<Option<T>> {
    std::thread::scope(|scope| {
        let work = &work;
        let threads: Vec<_> = ThreadRanks::new(count)
            .into_iter()
            .map(|rank| scope.spawn(move || work(Arc::new(rank))))
            .collect();
        threads
            .into_iter()
            .map(|thread| thread.join().ok())
            .collect()
    })
}

impl Ranks for ThreadRanks {
    fn rank(&self) -> usize {
        self.rank
    }

    fn count(&self) -> usize {
        self.mail().has_left.len()
    }

    fn all_to_all(
        &self,
        send: &[f64],
        to: &[usize],
        receive: &mut [f64],
        from: &[usize],
    ) -> Result<(), Error> {
        let mut send = send;
        let mut receive = receive;
        let mut mail = self.mail();
        for (rank, &length) in to.iter().enumerate() {
            let (message, rest) = send.split_at(length);
            send = rest;
            if length > 0 {
                mail.boxes[rank][self.rank].push_back(message.to_vec());
            }
        }
        self.office.news.notify_all();
        for (rank, &length) in from.iter().enumerate().filter(|(_, length)| **length > 0) {
            let message = loop {
                match mail.boxes[self.rank][rank].pop_front() {
                    Some(message) => break message,
                    None if mail.has_left[rank] => return Err(Error::RankLost { rank }),
                    None => {
                        mail = self
                            .office
                            .news
                            .wait(mail)
                            .unwrap_or_else(PoisonError::into_inner)
                    }
                }
            };
            let (place, rest) = receive.split_at_mut(length);
            place.copy_from_slice(&message);
            receive = rest;
        }
        Ok(())
    }
}

impl Drop for ThreadRanks {
    /// Nobody waits for a rank that has ended, however it did.
    fn drop(&mut self) {
        self.mail().has_left[self.rank] = true;
        self.office.news.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_of_any_length_arrive_in_order_and_a_rank_that_ends_lets_nobody_wait() {
        let found = on_threads(3, |ranks| {
            let own = ranks.rank();
            // Rank r gives r + 1 values to the ranks above it.
            let give = |from: usize, to: usize| if to > from { from + 1 } else { 0 };
            let to: Vec<usize> = (0..3).map(|rank| give(own, rank)).collect();
            let from: Vec<usize> = (0..3).map(|rank| give(rank, own)).collect();
            let mut got = vec![f64::NAN; from.iter().sum()];
            for round in 0..3 {
                let send = vec![(10 * round + own) as f64; to.iter().sum()];
                ranks.all_to_all(&send, &to, &mut got, &from).unwrap();
            }
            assert!(own != 1, "this one ends early");
            (
                got,
                ranks.all_to_all(&[1.0; 3], &[1; 3], &mut [0.0; 3], &[1; 3]),
            )
        });
        let lost = Err(Error::RankLost { rank: 1 });
        assert_eq!(
            found,
            [
                Some((vec![], lost.clone())),
                None,
                Some((vec![20.0, 21.0, 21.0], lost))
            ]
        );
    }
}
