//! Mistakes made of sound recordings, and the cause that is named.

use crate::full::either;
use nalgebra::Vector3;
use touchup::diagnose::{InputFinding, InputMonitor, InputMonitorParams};
use touchup::mesh::FaceTree;
use touchup::sim::{
    Habit, INPUT_MISTAKES, InputMistake, PathParams, Plate, ScannerParams, SensorParams,
    StylusParams, ToldRecording, plan_demo, plan_sides, scan, touch,
};
use touchup::stylus::{
    CompensatorParams, ContactEstimator, ContactEstimatorParams, Placement, SyncParams,
    Synchroniser, TipParams, TipShape,
};

/// Another stylus, sensor and scan for each seed.
fn simulated(seed: u64) -> ToldRecording {
    let radius = [1.5e-3, 0.8e-3, 3e-3, 2e-3][seed as usize % 4];
    let stiffness = [20e3, 200e3, 10e3, 50e3, 15e3][seed as usize % 5];
    let times = [1.0, 0.3, 1.5][seed as usize % 3];
    let friction = [0.15, 0.05, 0.3, 0.2][seed as usize % 4];
    let plate = Plate::default();
    let usual = SensorParams::default();
    let sensor = SensorParams {
        pose_noise: usual.pose_noise * times,
        force_noise: usual.force_noise * times,
        ..usual
    };
    let stylus = StylusParams {
        radius,
        stiffness,
        friction,
        sensor,
        ..StylusParams::default()
    };
    let path = plan_demo(
        &plate,
        &PathParams {
            radius,
            ..PathParams::default()
        },
    )
    .unwrap();
    let messages = touch(&plate, &path, &stylus, seed).unwrap().messages;
    let usual = ScannerParams::default();
    let scan = scan(
        &plate,
        &ScannerParams {
            noise: usual.noise * times,
            seed,
            ..usual
        },
    )
    .unwrap();
    ToldRecording {
        scan,
        messages,
        tip: TipParams {
            radius,
            stiffness: Some(stiffness),
        },
    }
}

fn findings(input: &ToldRecording) -> Vec<InputFinding> {
    let sync = SyncParams::default();
    let contact = ContactEstimatorParams::new(input.tip);
    let mut monitor = InputMonitor::new(InputMonitorParams {
        compensator: CompensatorParams::default(),
        tip: input.tip,
        shape: TipShape::Ball,
        scan_noise: 0.0,
        placement: Placement::default(),
        gate: contact.gate,
        sync,
    })
    .unwrap();
    let (mut sync, mut contacts) = (
        Synchroniser::new(sync).unwrap(),
        ContactEstimator::new(contact).unwrap(),
    );
    let mut take = |sync: &mut Synchroniser, monitor: &mut InputMonitor| {
        while let Some(sample) = sync.next_sample() {
            monitor.sample(&sample);
            if let Ok(contact) = contacts.observe(&sample) {
                monitor.contact(contact);
            }
        }
    };
    for message in &input.messages {
        monitor.message(message);
        sync.push(*message);
        take(&mut sync, &mut monitor);
    }
    sync.finish();
    take(&mut sync, &mut monitor);
    monitor.findings(&input.scan, &FaceTree::new(&input.scan))
}

/// Mistakes that are not the first and sure finding, of how many.
fn missed(seed: u64) -> (Vec<&'static str>, usize) {
    let sound = simulated(seed);
    assert_eq!(findings(&sound), [], "seed {seed}");
    let is_named = |mistake: &&InputMistake| {
        let found = findings(&mistake.made_of(&sound));
        found
            .first()
            .is_some_and(|first| first.cause == mistake.cause && first.is_sure)
    };
    let missed = INPUT_MISTAKES.iter().filter(|mistake| !is_named(mistake));
    (
        missed.map(|mistake| mistake.name).collect(),
        INPUT_MISTAKES.len(),
    )
}

#[test]
fn sound_input_raises_no_alarm_and_each_mistake_is_named() {
    for seed in 3..=either(3, 4) {
        assert_eq!(missed(seed).0, [""; 0], "seed {seed}");
    }
}

/// A ball as wide as the holes of the plate (seeds 2, 6, 10, …) rests on their rims: there neither
/// its free motion nor its stop is clear.
// The plate's scan is open below, and a hand that reaches it from its sides touches mostly where
// the scan has ended: beyond a rim a signed distance says nothing.
#[test]
fn a_part_touched_on_all_sides_of_an_open_scan_raises_no_alarm() {
    let plate = Plate::default();
    let hand = PathParams {
        radius: 3e-3,
        longest: 20.0,
        ..PathParams::default()
    };
    let sides = [
        Vector3::x_axis(),
        -Vector3::x_axis(),
        Vector3::y_axis(),
        -Vector3::y_axis(),
    ];
    let path = plan_sides(&plate, &sides, Habit::Slide, &hand).unwrap();
    let stylus = StylusParams {
        radius: hand.radius,
        ..StylusParams::default()
    };
    let messages = touch(&plate, &path, &stylus, 4).unwrap().messages;
    let scan = scan(
        &plate,
        &ScannerParams {
            seed: 4,
            ..ScannerParams::default()
        },
    )
    .unwrap();
    let tip = TipParams {
        radius: hand.radius,
        stiffness: Some(stylus.stiffness),
    };
    let found = findings(&ToldRecording {
        scan,
        messages,
        tip,
    });
    assert!(found.iter().all(|finding| !finding.is_sure), "{found:?}");
}

#[test]
#[ignore = "a slow proof"]
fn over_twenty_seeds_nine_of_ten_mistakes_are_named() {
    let (mut all, mut lost) = (0, 0);
    for seed in 1..=20 {
        let (missed, count) = missed(seed);
        println!(
            "| {seed} | {} of {count} | {} |",
            count - missed.len(),
            missed.join(", ")
        );
        (all, lost) = (all + count, lost + missed.len());
    }
    assert!(10 * lost <= all, "{lost} of {all}");
}
