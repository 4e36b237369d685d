//! Work in independent pieces: pure code lists the pieces, its caller decides how they run.

/// A piece of work.
pub type Task<'a> = Box<dyn FnOnce() + Send + 'a>;

/// Runs independent pieces of work. The results depend neither on the threads nor on the order.
pub trait Workers: Sync {
    /// Approximate number of pieces in progress at the same time.
    fn count(&self) -> usize;

    /// Completes all pieces before it returns.
    fn run(&self, jobs: Vec<Task<'_>>);
}

/// One piece after the other, in the calling thread.
#[derive(Clone, Copy, Debug, Default)]
pub struct SerialWorkers;

impl Workers for SerialWorkers {
    fn count(&self) -> usize {
        1
    }

    fn run(&self, jobs: Vec<Task<'_>>) {
        jobs.into_iter().for_each(|job| job());
    }
}

/// Smallest number of items in a piece: a thread costs as much as a hundred closest faces.
const LEAST_PIECE: usize = 4_000;

/// Results of `each` for 0 to `count` − 1, in this order, for any workers.
pub fn map_by<T: Send>(
    workers: &dyn Workers,
    count: usize,
    each: impl Fn(usize) -> T + Sync,
) -> Vec<T> {
    map_pieces_by(workers, count, LEAST_PIECE, each)
}

/// [`map_by`] for items worth a thread from `least` on.
pub fn map_pieces_by<T: Send>(
    workers: &dyn Workers,
    count: usize,
    least: usize,
    each: impl Fn(usize) -> T + Sync,
) -> Vec<T> {
    let pieces = workers.count().min(count / least).max(1);
    if pieces == 1 {
        return (0..count).map(each).collect();
    }
    let size = count.div_ceil(pieces);
    let mut parts: Vec<Vec<T>> = (0..pieces).map(|_| Vec::new()).collect();
    let each = &each;
    let jobs = parts.iter_mut().enumerate().map(|(at, part)| {
        let own = (at * size).min(count)..((at + 1) * size).min(count);
        Box::new(move || part.extend(own.map(each))) as Task<'_>
    });
    workers.run(jobs.collect());
    parts.into_iter().flatten().collect()
}

/// For tests: as if `self.0` pieces ran at the same time, the last one first.
#[cfg(test)]
pub(in crate::mesh) struct ReversedWorkers(pub usize);

#[cfg(test)]
impl Workers for ReversedWorkers {
    fn count(&self) -> usize {
        self.0
    }

    fn run(&self, jobs: Vec<Task<'_>>) {
        jobs.into_iter().rev().for_each(|job| job());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_item_comes_once_and_in_order_whoever_does_it() {
        for count in [0, 1, LEAST_PIECE - 1, 2 * LEAST_PIECE, 3 * LEAST_PIECE + 1] {
            let by_hand: Vec<usize> = (0..count).map(|i| i * i).collect();
            for workers in 1..6 {
                assert_eq!(
                    map_by(&ReversedWorkers(workers), count, |i| i * i),
                    by_hand,
                    "{count} by {workers}"
                );
            }
            assert_eq!(map_by(&SerialWorkers, count, |i| i * i), by_hand);
        }
    }
}
