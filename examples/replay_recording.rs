//! A scan and a ROS 2 recording in, a refined mesh out: `touchup refine` by the library.
//!
//! cargo run --release -- demo
//! cargo run --release --example replay_recording out/scan.ply out/touch.mcap refined.ply

use std::iter::from_fn;
use std::path::Path;

use touchup::haptic::{RefineParams, Refiner};
use touchup::io::mesh_file::{MeshUnit, read_mesh, write_mesh};
use touchup::io::recording::{RecordingReader, Topics};
use touchup::stylus::{SyncParams, Synchroniser, TipParams};

fn main() -> anyhow::Result<()> {
    let arguments: Vec<_> = std::env::args().skip(1).collect();
    let [scan, bag, out] = &arguments[..] else {
        anyhow::bail!("give a scan, a recording and an output file")
    };

    let scan = read_mesh(Path::new(scan), MeshUnit::Millimetre)?;
    println!("{}", scan.repair);
    // a ball of 3 mm on a stylus that deflects by 1 mm at 20 N; wrenches in the axes of the stylus
    let tip = TipParams {
        radius: 1.5e-3,
        stiffness: Some(20e3),
    };
    let mut refiner = Refiner::new(scan.mesh, RefineParams::robust(tip))?;

    let mut recording = RecordingReader::open(Path::new(bag), &Topics::default())?;
    let mut sync = Synchroniser::new(SyncParams::default())?;
    for message in recording.by_ref() {
        // poses and wrenches come at different rates: a sample is a wrench with the pose
        // interpolated at its stamp
        sync.push(message?);
        from_fn(|| sync.next_sample()).try_for_each(|sample| refiner.push(&sample).map(drop))?;
    }
    sync.finish();
    from_fn(|| sync.next_sample()).try_for_each(|sample| refiner.push(&sample).map(drop))?;

    println!(
        "{:?}\nwrenches without a pose: {}",
        refiner.counts(),
        sync.counts().total()
    );
    write_mesh(Path::new(out), refiner.mesh(), MeshUnit::Millimetre)?;
    Ok(())
}
