//! Speed of one thread that reads and refines a recording.

use std::path::Path;

use super::pushes::{BAREST, refiner_of, touched_plate};
use super::turns::spread;
use crate::error::{MeasureError, MeasureResult};
use crate::{Spread, timed};
use touchup_io::recording::{StampSource, Topics, write_recording};
use touchup_method::stylus::{Message, Sample, StampedPose, StampedWrench, SyncParams};
use touchup_session::replay::{Recording, ReplayError, each_sample};
use touchup_session::scene::Scene;

/// Reading and synchronisation alone.
pub const READING: &str = "none: read and paired alone";

/// One scene over the whole recording.
#[derive(Clone, Debug, PartialEq)]
pub struct ReplaySpeed {
    /// scene by name
    pub scene: String,
    /// faces of the scan
    pub faces: usize,
    /// length of its short edges, mm
    pub edge_mm: f64,
    /// samples of the recording
    pub samples: usize,
    /// rate of reading, synchronising and pushing
    pub samples_per_s: Spread,
}

/// Writes the recording of a slide and replays it, reading alone and through each scene.
pub(super) fn replay_speeds(
    (faces, side): (usize, f64),
    count: usize,
    repeats: usize,
) -> MeasureResult<Vec<ReplaySpeed>> {
    let folder = tempfile::tempdir().map_err(MeasureError::Folder)?;
    let path = folder.path().join("slide.mcap");
    let (mesh, samples) = touched_plate(faces, side, count)?;
    let topics = Topics::default();
    let written = write_recording(
        &path,
        &topics,
        "object",
        "stylus",
        samples.iter().flat_map(messages),
    );
    written.map_err(ReplayError::from)?;
    let edge_mm = side / (mesh.face_count() as f64 / 2.0).sqrt() * 1e3;
    // one after the other: each refiner of a million faces takes its part of the cache
    let of = |scene: &Scene| {
        refiner_of(scene, mesh.clone()).map(|refiner| (scene.sync_params(), refiner))
    };
    let scenes = [
        ("cheapest", Scene::from_yaml(BAREST)?),
        ("default, without patch", Scene::default()),
    ];
    let built = scenes
        .iter()
        .map(|(_, scene)| of(scene))
        .collect::<Result<Vec<_>, _>>()?;
    let mut rates = vec![Vec::new(); built.len() + 1];
    for _ in 0..repeats {
        rates[0].push(replay(&path, &topics, SyncParams::default(), |_| Ok(()))?);
        for ((sync, refiner), rates) in built.iter().zip(&mut rates[1..]) {
            let mut refiner = refiner.clone();
            rates.push(replay(&path, &topics, *sync, |sample| {
                Ok(refiner.push(sample).map(drop)?)
            })?);
        }
    }
    let names = [READING]
        .into_iter()
        .chain(scenes.iter().map(|(name, _)| *name));
    let speed = |(name, rates): (&str, Vec<f64>)| {
        Ok(ReplaySpeed {
            scene: name.to_owned(),
            faces: mesh.face_count(),
            edge_mm,
            samples: count,
            samples_per_s: spread(rates)?,
        })
    };
    names.zip(rates).map(speed).collect()
}

/// The two messages of a sample.
pub(super) fn messages(sample: &Sample) -> [Message; 2] {
    let &Sample {
        stamp_ns,
        pose_ot,
        wrench,
    } = sample;
    [
        Message::Pose(StampedPose { stamp_ns, pose_ot }),
        Message::Wrench(StampedWrench { stamp_ns, wrench }),
    ]
}

/// Reads and pairs all, and gives each sample to `push`; returns their rate, 1/s.
fn replay(
    path: &Path,
    topics: &Topics,
    sync: SyncParams,
    mut push: impl FnMut(&Sample) -> MeasureResult<()>,
) -> MeasureResult<f64> {
    let (mut count, mut outcome) = (0, Ok(()));
    let (seconds, replayed) = timed(|| {
        each_sample(
            Recording::open(path, topics, StampSource::Header)?,
            None,
            sync,
            None,
            &mut || {},
            &mut |_| (),
            |sample| {
                count += 1;
                if outcome.is_ok() {
                    outcome = push(sample);
                }
            },
        )
    });
    replayed?;
    outcome.map(|()| f64::from(count) / seconds)
}
