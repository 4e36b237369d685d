//! Taking one touch out and putting it back, beside `touchup refine` on a recording without its
//! samples.

use std::path::Path;

use touchup::ros::messages::{
    Header, Point, PointStamped, TakeOutTouchRequest, TakeOutTouchResponse, Time, UndoRequest,
    UndoResponse,
};
use touchup::ros::port::Call;
use touchup::stylus::Message;

use super::samples::bench::{Bench, Plate, read, refine};

const FILES: [&str; 3] = ["refined.ply", "features.json", "touches.csv"];

/// A request for the touch nearest to the ball at a share of the messages.
fn near(plate: &Plate, share: f64) -> TakeOutTouchRequest {
    let from = (plate.messages.len() as f64 * share) as usize;
    let there = plate.messages[from..]
        .iter()
        .find_map(|message| match message {
            Message::Pose(pose) => Some(pose.pose_ot.translation),
            Message::Wrench(_) => None,
        })
        .unwrap();
    let point = Point {
        x: there.x,
        y: there.y,
        z: there.z,
    };
    let header = Header {
        frame_id: "object".to_owned(),
        ..Header::default()
    };
    TakeOutTouchRequest {
        point: PointStamped { header, point },
        ..TakeOutTouchRequest::default()
    }
}

fn call(bench: &Bench, request: TakeOutTouchRequest) -> TakeOutTouchResponse {
    bench.call(|reply| Call::TakeOut(request, reply))
}

/// The same with a successful answer.
fn done(bench: &Bench, request: TakeOutTouchRequest) -> TakeOutTouchResponse {
    let answer = call(bench, request);
    assert!(answer.success, "{}", answer.message);
    answer
}

fn undo(bench: &Bench) -> UndoResponse {
    bench.call(|reply| Call::Undo(UndoRequest { strokes: 1 }, reply))
}

fn ns(time: Time) -> i64 {
    i64::from(time.sec) * 1_000_000_000 + i64::from(time.nanosec)
}

/// A recording that has no wrench from when a touch began until it had ended, and so no sample.
fn without(messages: &[Message], touch: &TakeOutTouchResponse) -> Vec<Message> {
    let span = ns(touch.touch)..ns(touch.until);
    let is_left = |message: &&Message| {
        matches!(message, Message::Pose(_)) || !span.contains(&message.stamp_ns())
    };
    messages.iter().filter(is_left).copied().collect()
}

/// Results of `touchup refine` on messages, in the order of [`FILES`].
fn refined(plate: &Plate, messages: &[Message]) -> [Vec<u8>; 3] {
    plate.record("left.mcap", messages);
    let folder = plate.path("refined");
    std::fs::create_dir_all(&folder).unwrap();
    let path = |name: &str| folder.join(name);
    let (scan, bag, [mesh, features, touches]) = (
        plate.path("scan.ply"),
        plate.path("left.mcap"),
        FILES.map(path),
    );
    let flags = [
        "--scan",
        "--bag",
        "--out",
        "--features-out",
        "--touches-out",
    ]
    .map(AsRef::as_ref);
    let files = [&scan, &bag, &mesh, &features, &touches].map(|path| path.as_os_str());
    let mut arguments: Vec<_> = flags
        .into_iter()
        .zip(files)
        .flat_map(|(flag, file)| [flag, file])
        .collect();
    arguments.push("--tip-radius-mm=1.5".as_ref());
    refine(&arguments);
    files_of(&folder)
}

fn files_of(folder: &Path) -> [Vec<u8>; 3] {
    FILES.map(|name| read(folder, name))
}

/// Samples arrive during the removal, and are in the result as well.
#[test]
fn a_touch_that_is_taken_out_is_as_if_it_had_never_been() {
    let plate = Plate::touched_last(0.1);
    let bench = Bench::start(&plate);
    let now = plate.messages.len() * 6 / 10;
    bench.feed(&plate.messages[..now]);
    let asked = near(&plate, 0.3);
    let seen = done(
        &bench,
        TakeOutTouchRequest {
            preview: true,
            ..asked.clone()
        },
    );
    assert!(
        seen.contacts > 20 && (2..=24).contains(&seen.points.len()),
        "{} {}",
        seen.contacts,
        seen.points.len()
    );
    let far = |p: &Point| (p.x - asked.point.point.x).hypot(p.y - asked.point.point.y);
    assert!(seen.points.iter().map(far).fold(f64::INFINITY, f64::min) < 5e-3);
    let answers = bench.world.call(|reply| {
        Call::TakeOut(
            TakeOutTouchRequest {
                touch: seen.touch,
                ..TakeOutTouchRequest::default()
            },
            reply,
        )
    });
    bench.feed(&plate.messages[now..]);
    let out = bench.answer(&answers);
    assert!(
        out.success && out.mesh_version > seen.mesh_version,
        "{}",
        out.message
    );
    assert_eq!(
        (out.touch, out.until, out.contacts),
        (seen.touch, seen.until, seen.contacts)
    );
    let (end, _) = bench.end();
    let was = files_of(&end.folder);
    let expected = refined(&plate, &without(&plate.messages, &out));
    assert!(was == expected, "the node's mesh, features and touches");
    assert!(
        was != refined(&plate, &plate.messages),
        "it was of some importance"
    );
    refine(&["--resume".as_ref(), end.folder.as_os_str()]);
    assert!(
        files_of(&end.folder) == expected,
        "what is made of the session's record"
    );
}

#[test]
#[expect(clippy::too_many_lines)]
fn what_is_put_back_is_as_if_it_had_never_been_out_also_beside_strokes_that_are_undone() {
    let plate = Plate::touched_last(0.1);
    let bench = Bench::start(&plate);
    let refused = call(&bench, near(&plate, 0.3));
    assert!(
        !refused.success && refused.message.contains("nothing is touched yet"),
        "{}",
        refused.message
    );
    bench.feed(&plate.messages);
    let refused = call(
        &bench,
        TakeOutTouchRequest {
            put_back: true,
            ..TakeOutTouchRequest::default()
        },
    );
    assert!(
        !refused.success && refused.message.contains("no touch is taken out"),
        "{}",
        refused.message
    );
    let beside = PointStamped {
        point: Point {
            x: 0.5,
            y: 0.5,
            z: 0.5,
        },
        ..near(&plate, 0.3).point
    };
    let refused = call(
        &bench,
        TakeOutTouchRequest {
            point: beside,
            ..TakeOutTouchRequest::default()
        },
    );
    assert!(
        refused
            .message
            .contains("nothing was touched within 5.0 mm"),
        "{}",
        refused.message
    );
    let unknown = TakeOutTouchRequest {
        touch: Time { sec: 7, nanosec: 0 },
        ..TakeOutTouchRequest::default()
    };
    assert!(
        call(&bench, unknown)
            .message
            .contains("no touch has this stamp")
    );

    let [first, second] = [0.2, 0.6].map(|share| near(&plate, share));
    let out = done(&bench, first);
    // one at a time, and strokes stay unchanged meanwhile
    let answers = bench
        .world
        .call(|reply| Call::TakeOut(second.clone(), reply));
    assert!(undo(&bench).message.contains("is being taken out"));
    let other = bench.answer(&answers);
    assert!(
        other.success && other.touch != out.touch,
        "{}",
        other.message
    );
    // the last one back, then the first
    let back = done(
        &bench,
        TakeOutTouchRequest {
            put_back: true,
            ..TakeOutTouchRequest::default()
        },
    );
    assert_eq!((back.touch, back.contacts), (other.touch, other.contacts));
    let named = TakeOutTouchRequest {
        put_back: true,
        touch: out.touch,
        ..TakeOutTouchRequest::default()
    };
    assert_eq!(done(&bench, named).contacts, out.contacts);
    let save = |name: &str| {
        let request = touchup::ros::messages::SaveMeshRequest {
            name: name.to_owned(),
            ..Default::default()
        };
        bench.call(|reply| Call::Save(request, reply))
    };
    let saved = save("all.ply");
    assert!(
        std::fs::read(saved.path).unwrap() == plate.refined("touch.mcap"),
        "all are in again"
    );

    // one more removal beside an undone one; the session's record has the rest of both
    assert!(undo(&bench).success);
    done(&bench, second.clone());
    let (end, _) = bench.end();
    let was = files_of(&end.folder);
    refine(&["--resume".as_ref(), end.folder.as_os_str()]);
    assert!(files_of(&end.folder) == was, "as the session had it");
}
