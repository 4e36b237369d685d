//! Recordings from outside: real ones, damaged ones, our own.
//!
//! Numbers of real recordings were taken with the Python package `rosbags` 0.11.9 (AnyReader, `math.fsum` of each
//! field), which shares no code with this crate.

use std::fs;
use std::path::{Path, PathBuf};

use nalgebra::Vector3;
use touchup::io::recording::{Recorded, RecordingReader, Topics};
use touchup::touch::{StampedPose, StampedWrench};

/// The real data beside the repository; `None` skips the test, except in CI, where it fails.
fn shared(path: &str) -> Option<PathBuf> {
    let full = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data").join(path);
    if full.exists() {
        return Some(full);
    }
    assert!(std::env::var_os("CI").is_none(), "{} is missing", full.display());
    println!("skipped: {} is missing", full.display());
    None
}

fn probe_topics() -> Topics {
    Topics { pose: "/probe/pose".into(), wrench: "/probe/wrench".into() }
}

fn poses_and_wrenches(messages: &[Recorded]) -> (Vec<StampedPose>, Vec<StampedWrench>) {
    let mut split = (Vec::new(), Vec::new());
    for message in messages {
        match message {
            Recorded::Pose(pose) => split.0.push(*pose),
            Recorded::Wrench(wrench) => split.1.push(*wrench),
        }
    }
    split
}

fn read_all(path: &Path, topics: &Topics) -> Vec<Recorded> {
    RecordingReader::open(path, topics).unwrap().collect::<Result<_, _>>().unwrap()
}

/// 12,000 additions of numbers below 1 kN: 12,000 roundings of a sum below 1e5.
const SUM_TOL: f64 = 12_000.0 * 1e5 * f64::EPSILON;

#[test]
fn kidney_gives_the_samples_that_rosbags_reads() {
    let Some(folder) = shared("force/bags/kidneyZ1_mcap") else { return };
    let mut reader = RecordingReader::open(&folder, &probe_topics()).unwrap();
    assert_eq!(reader.message_count(), Some(12_000));
    let messages: Vec<_> = reader.by_ref().map(Result::unwrap).collect();
    assert_eq!((reader.pose_frame(), reader.wrench_frame()), (Some("psm_base"), Some("psm_base")));
    assert!(reader.bad_messages().is_empty() && !reader.truncated());

    let (poses, wrenches) = poses_and_wrenches(&messages);
    assert_eq!((poses.len(), wrenches.len()), (6000, 6000));
    let stamps = |stamps: &mut dyn Iterator<Item = i64>| stamps.map(i128::from).sum::<i128>();
    assert_eq!(stamps(&mut poses.iter().map(|p| p.stamp_ns)), 8_862_000_292_086_466_200_000);
    assert_eq!(stamps(&mut wrenches.iter().map(|w| w.stamp_ns)), 8_862_000_292_086_466_200_000);
    let (first, last) = (poses[0], poses[5999]);
    assert_eq!(first.stamp_ns, 1_477_000_002_840_800_000);
    assert_eq!(first.pose_ot.translation.vector, Vector3::new(0.011192, -0.009599, -0.1307799));
    assert_eq!(last.stamp_ns, 1_477_000_094_575_900_000);
    assert_eq!(last.pose_ot.translation.vector, Vector3::new(0.0167898, -0.00031790000000000003, -0.1423268));
    let position: Vector3<f64> = poses.iter().map(|p| p.pose_ot.translation.vector).sum();
    assert!((position - Vector3::new(117.7448295, -48.7414362, -887.5090616)).amax() < SUM_TOL);
    let q = first.pose_ot.rotation;
    // five decimals in the file: its norms are 0.99986 to 1.00013, ours are 1
    let x_y_z_w = [0.0193, 0.63583, -0.76957, 0.05762];
    assert!([q.i, q.j, q.k, q.w].iter().zip(x_y_z_w).all(|(ours, theirs)| (ours - theirs).abs() < 1.5e-4));
    assert_eq!(wrenches[0].wrench.force, Vector3::new(0.18851, -0.06669, 0.13242));
    assert_eq!(wrenches[5999].wrench.force, Vector3::new(0.12428, -0.19402, 0.02216));
    let force: Vector3<f64> = wrenches.iter().map(|w| w.wrench.force).sum();
    assert!((force - Vector3::new(760.83443, -335.11331, 916.58731)).amax() < SUM_TOL);
    assert!(wrenches.iter().all(|w| w.wrench.torque == Vector3::zeros()));
}

#[test]
fn kidney_is_the_same_in_both_containers() {
    let (Some(mcap), Some(db3)) = (shared("force/bags/kidneyZ1_mcap"), shared("force/bags/kidneyZ1_db3")) else {
        return;
    };
    let from_mcap = read_all(&mcap, &probe_topics());
    assert_eq!(from_mcap, read_all(&db3, &probe_topics()));
    assert_eq!(from_mcap, read_all(&db3.join("kidneyZ1_db3.db3"), &probe_topics()), "the file without its folder");
}

#[test]
fn judge_cases_have_the_messages_their_metadata_state() {
    let Some(cases) = shared("cases") else { return };
    let mut folders: Vec<_> = fs::read_dir(cases).unwrap().map(|entry| entry.unwrap().path()).collect();
    folders.sort();
    assert_eq!(folders.len(), 7);
    for folder in folders {
        let meta: serde_json::Value = serde_json::from_slice(&fs::read(folder.join("meta.json")).unwrap()).unwrap();
        let mut reader = RecordingReader::open(&folder.join("touch.mcap"), &Topics::default()).unwrap();
        let messages: Vec<_> = reader.by_ref().map(Result::unwrap).collect();
        let (poses, wrenches) = poses_and_wrenches(&messages);
        assert_eq!(Some(poses.len() as u64), meta["poses"].as_u64(), "{folder:?}");
        assert_eq!(Some(wrenches.len() as u64), meta["wrenches"].as_u64(), "{folder:?}");
        assert_eq!((reader.pose_frame(), reader.wrench_frame()), (Some("object"), Some("stylus")));
    }
}

#[test]
fn plate_gives_the_sums_that_rosbags_reads() {
    let Some(path) = shared("cases/plate/touch.mcap") else { return };
    let (poses, wrenches) = poses_and_wrenches(&read_all(&path, &Topics::default()));
    assert_eq!((poses.len(), wrenches.len()), (37_802, 75_590));
    assert_eq!(wrenches.iter().map(|w| i128::from(w.stamp_ns)).sum::<i128>(), 133_038_402_874_237_911_713_631);
    // the file holds multiples of 2^-22 m and 2^-12 N or coarser, so these sums are exact in any order
    let position: Vector3<f64> = poses.iter().map(|p| p.pose_ot.translation.vector).sum();
    assert_eq!(position, Vector3::new(988.9942569732666, 1809.0157299041748, 481.8626708984375));
    let force: Vector3<f64> = wrenches.iter().map(|w| w.wrench.force).sum();
    assert_eq!(force, Vector3::new(1050.29833984375, -4037.46337890625, 119716.17724609375));
}
