//! Comparison with alternatives for users: libraries from PyPI, on the same mesh, with the same
//! queries, on one thread.
//!
//! This module has the input, touchup's own times, the script that measures the peers, and the
//! comparison. The command line handles files and processes.

mod input;
mod text;

use serde::Deserialize;

pub use input::PeersInput;

use super::Spread;

/// Measures the peers; prints a [`PeerTimes`] or a [`PeerError`] as JSON on each line.
pub const SCRIPT: &str = include_str!("peers.py");
/// Its requirements, in tested versions.
pub const PACKAGES: [&str; 7] = [
    "numpy==2.4.6",
    "scipy==1.17.1",
    "scikit-learn==1.9.1",
    "open3d==0.20.0",
    "libigl==2.6.3",
    "trimesh==5.2.0",
    // without it trimesh has no tree
    "rtree==1.4.1",
];
/// Target factor, per sample.
pub const WANTED_FACTOR: f64 = 100.0;
/// Largest relative difference of two equal distances.
pub const AGREEMENT: f64 = 1e-9;

/// Times of one peer from the script, or of touchup itself.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
pub struct PeerTimes {
    /// name
    pub peer: String,
    /// versions of its libraries; empty for touchup
    pub versions: String,
    /// update method of its index
    pub update: String,
    /// one closest face per call, µs
    pub query_us: Spread,
    /// one call for all, µs for each, if supported. For touchup a query near the last
    pub batched_query_us: Option<Spread>,
    /// closest face, ring moved, index exact again, µs. For touchup a whole push: filter, gate,
    /// closest face, dynamics, deformation, guard, tree
    pub pipeline_us: Spread,
    /// distances, m; empty without a closest-face query
    distances_m: Vec<Option<f64>>,
    /// largest difference from touchup's distance, relative; `None` without a closest-face query
    #[serde(skip)]
    pub largest_difference: Option<f64>,
}

/// Failed measurement of a peer.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct PeerError {
    /// name
    pub peer: String,
    /// its output
    pub error: String,
}

/// All peers on one mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct PeersAtSize {
    /// faces of the mesh
    pub faces: usize,
    /// touchup before the peers and after them
    pub touchup: [PeerTimes; 2],
    /// peers with times
    pub peers: Vec<PeerTimes>,
    /// failed peers
    pub failed: Vec<PeerError>,
}

/// The comparison.
#[derive(Clone, Debug, PartialEq)]
pub struct Peers {
    /// the smallest mesh first
    pub sizes: Vec<PeersAtSize>,
}

/// A line of the script that is neither times nor a failure.
#[derive(Debug, thiserror::Error)]
#[error("the peers' script said {line:?}: {error}")]
pub struct UnknownLine {
    /// the line verbatim
    pub line: String,
    /// the error
    pub error: serde_json::Error,
}

impl PeerTimes {
    /// Whether it found touchup's distances, to [`AGREEMENT`].
    pub fn agrees(&self) -> bool {
        self.largest_difference
            .is_some_and(|difference| difference <= AGREEMENT)
    }
}

impl PeersAtSize {
    /// Parses the script's output, and compares its distances with the distances of `input`.
    ///
    /// # Errors
    /// [`UnknownLine`]
    pub fn read(
        input: &PeersInput,
        touchup: [PeerTimes; 2],
        printed: &str,
    ) -> Result<Self, UnknownLine> {
        let (mut peers, mut failed) = (Vec::new(), Vec::new());
        for line in printed.lines().filter(|line| !line.trim().is_empty()) {
            if let Ok(failure) = serde_json::from_str(line) {
                failed.push(failure);
                continue;
            }
            let read = serde_json::from_str::<PeerTimes>(line);
            let times = read.map_err(|error| UnknownLine {
                line: line.chars().take(200).collect(),
                error,
            })?;
            let largest_difference = largest_difference(&times.distances_m, &input.distances);
            peers.push(PeerTimes {
                largest_difference,
                ..times
            });
        }
        Ok(Self {
            faces: input.mesh.face_count(),
            touchup,
            peers,
            failed,
        })
    }

    /// Whole pushes, the slower of both turns, µs.
    pub fn push_us(&self) -> f64 {
        self.touchup
            .iter()
            .map(|times| times.pipeline_us.median)
            .fold(0.0, f64::max)
    }

    /// The fastest pipeline with an exact index. Open3D's single precision counts as exact, and so
    /// does the nearest barycentre for its own query: the strictest comparison.
    pub fn fastest_pipeline(&self) -> Option<&PeerTimes> {
        let is_sound = |times: &&PeerTimes| {
            times
                .largest_difference
                .is_none_or(|difference| difference < 1e-2)
        };
        let sound = self.peers.iter().filter(is_sound);
        sound.min_by(|a, b| a.pipeline_us.median.total_cmp(&b.pipeline_us.median))
    }

    /// The fastest query alone, one per call.
    pub fn fastest_query(&self) -> Option<&PeerTimes> {
        self.peers
            .iter()
            .min_by(|a, b| a.query_us.median.total_cmp(&b.query_us.median))
    }

    /// Speed-up of a push over the fastest pipeline.
    pub fn pipeline_factor(&self) -> Option<f64> {
        Some(self.fastest_pipeline()?.pipeline_us.median / self.push_us())
    }

    /// Speed-up of a whole push over the fastest query alone.
    pub fn query_factor(&self) -> Option<f64> {
        Some(self.fastest_query()?.query_us.median / self.push_us())
    }
}

impl Peers {
    /// Whether both promises hold at every size: [`WANTED_FACTOR`] per sample, and a push faster
    /// than a query alone.
    pub fn holds(&self) -> bool {
        let beyond = |factor: Option<f64>, wanted| factor.is_some_and(|factor| factor >= wanted);
        self.sizes.iter().all(|size| {
            beyond(size.pipeline_factor(), WANTED_FACTOR) && beyond(size.query_factor(), 1.0)
        })
    }
}

fn largest_difference(found: &[Option<f64>], ours: &[f64]) -> Option<f64> {
    let pairs = found.iter().zip(ours);
    let mut differences = pairs.map(|(found, ours)| found.map(|found| (found - ours).abs() / ours));
    differences.try_fold(0.0, |largest: f64, difference| {
        Some(largest.max(difference?))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Chapter, Effort};

    fn line(peer: &str, query: f64, pipeline: f64, distance: f64) -> String {
        let spread =
            |median: f64| format!(r#"{{"median": {median}, "p10": {median}, "p90": {median}}}"#);
        format!(
            r#"{{"peer": "{peer}", "versions": "x 1", "update": "none", "build_ms": 1.0, "query_us": {}, "batched_query_us": null,
                "pipeline_us": {}, "pipeline_samples": 3, "distances_m": [{distance:e}]}}"#,
            spread(query),
            spread(pipeline)
        )
        .replace('\n', " ")
    }

    #[test]
    fn the_fastest_that_is_right_is_compared() {
        let input = PeersInput::new(200, Effort { is_quick: true }).unwrap();
        let times = |push: f64| PeerTimes {
            query_us: 0.5.into(),
            batched_query_us: Some(0.2.into()),
            pipeline_us: push.into(),
            ..PeerTimes::default()
        };
        let truth = input.distances[0];
        let printed = [
            line("right", 9.0, 300.0, truth),
            line("wrong", 20.0, 3.0, 1.5 * truth),
            r#"{"peer": "broken", "error": "ImportError: no"}"#.to_owned(),
        ];
        let size =
            PeersAtSize::read(&input, [times(1.0), times(2.0)], &printed.join("\n")).unwrap();
        assert_eq!((size.peers.len(), size.failed.len()), (2, 1));
        assert!(size.peers[0].agrees() && !size.peers[1].agrees());
        assert_eq!(size.pipeline_factor(), Some(150.0));
        assert_eq!(size.query_factor(), Some(4.5));
        let peers = Peers { sizes: vec![size] };
        assert!(peers.holds());
        // a picture and a table, under two names
        let Chapter {
            figures, tables, ..
        } = peers.chapter();
        assert!(figures.len() == 1 && tables.len() == 1 && figures[0].id != tables[0].id);
        assert!(PeersAtSize::read(&input, [times(1.0), times(1.0)], "Segmentation fault").is_err());
    }

    /// The queries lie 0.05 mm below the wavy plate along its normal, and a chord of it is off by
    /// d² κ / 8 at most: edges of 1.342 mm make diagonals d of 1.90 mm, and waves of 2 mm over 40
    /// mm curve by 49.3 /m at most.
    #[test]
    fn distances_are_those_of_the_plate() {
        let input = PeersInput::new(100_000, Effort { is_quick: true }).unwrap();
        let chord = 1.90e-3f64.powi(2) * 49.3 / 8.0;
        assert!(
            input.distances.iter().all(|d| (d - 0.05e-3).abs() < chord),
            "{:?}",
            input.distances
        );
        assert!(
            input
                .distances
                .iter()
                .any(|d| (d - 0.05e-3).abs() > 0.5 * chord),
            "no edge is met"
        );
        let lengths = input.files().map(|(_, bytes)| bytes.len());
        let of_mesh = [24 * input.mesh.vertex_count(), 12 * input.mesh.face_count()];
        assert_eq!(
            lengths,
            [of_mesh[0], 24 * input.distances.len(), of_mesh[1]]
        );
    }
}
