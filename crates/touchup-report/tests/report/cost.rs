//! The cost of a push in the report: the text from the numbers, and that both sides of the ratio do
//! the same work.

use touchup_geometry::mesh::{FaceTree, TriMesh};
use touchup_method::haptic::Refiner;
use touchup_method::stylus::WrenchFrame;
use touchup_report::allocations::asked;
use touchup_report::cost::{
    BAREST, Cost, LogLaw, MinimalLoop, ParryLoop, PartCost, PerSample, RecordingCost, ReplaySpeed,
    SizeCost, StageCost, cost,
};
use touchup_report::{Drawing, Effort, Figure, LineStroke, Scale, Series, Spread, TableCell};
use touchup_session::live::Quantiles;
use touchup_session::scene::Scene;
use touchup_sim::wavy::{slide, wavy_plate};

fn ns(median: f64) -> PerSample {
    PerSample {
        time_ns: Spread {
            median,
            p10: 0.9 * median,
            p90: 1.2 * median,
        },
        allocations: Some(0.0),
        allocated_bytes: None,
    }
}

/// 100 ns at 10k faces, 30 ns more for ten times as many, and 20 ns of the caches at a million.
#[expect(clippy::too_many_lines)]
fn made_up() -> Cost {
    let size = |faces: usize, push: f64, ratio: f64| SizeCost {
        faces,
        minimal: ns(push / ratio),
        barest: ns(push),
        barest_to_minimal: ratio.into(),
        keeping: ns(push / 1.3),
        barest_to_keeping: 1.3.into(),
        mesh_bytes_per_face: 60.0,
        tree_bytes_per_face: 40.0,
        tree_build_ms: 1.0,
    };
    let sizes = vec![
        size(10_000, 100.0, 0.9),
        size(100_000, 130.0, 1.02),
        size(1_000_000, 180.0, 0.8),
    ];
    let part = |part: &str, with: f64, without: f64| PartCost {
        part: part.to_owned(),
        faces: 100_000,
        is_default: true,
        with: ns(with),
        without: ns(without),
        cost_ns: (with - without).into(),
    };
    let replay = |scene: &str, samples_per_s: f64| ReplaySpeed {
        scene: scene.to_owned(),
        faces: 1_000_000,
        edge_mm: 1.0,
        samples: 1000,
        samples_per_s: samples_per_s.into(),
    };
    let recording = |faces: usize, edge: f64, median: u64, peer: u64| {
        let of = |median| Quantiles {
            median,
            p99: 3 * median,
            p999: 10 * median,
            max: 20 * median,
        };
        RecordingCost {
            faces,
            edge,
            samples: 1000,
            push: of(median),
            begin_ms: 1.0,
            patch_ms: 2.0,
            whole_us: 5.0,
            peer: of(peer),
            peer_moves: 30.0,
        }
    };
    Cost {
        by_edge: vec![
            recording(50_000, 1e-4, 4_000, 80_000),
            recording(50_000, 3e-3, 3_000, 6_000),
        ],
        by_faces: vec![
            recording(10_000, 1e-3, 3_100, 9_300),
            recording(100_000, 1e-3, 3_500, 9_500),
        ],
        sizes,
        barest_law: LogLaw::fit(&[(10_000, 100.0), (100_000, 130.0)]),
        parts: vec![part("guard", 520.0, 400.0), part("contact", 521.0, 520.0)],
        stages: vec![StageCost {
            stage: "sync".to_owned(),
            faces: 100_000,
            per_sample: ns(70.0),
        }],
        seldom: Vec::new(),
        replays: vec![replay("cheapest", 800_000.0), replay("default", 400_000.0)],
    }
}

fn curves_of(figure: &Figure) -> &[Series] {
    let Drawing::Curves(curves) = &figure.drawing else {
        panic!("curves are drawn")
    };
    curves
}

#[test]
fn the_text_reports_hits_and_misses_as_measured() {
    let mut cost = made_up();
    let text = cost.chapter().text.join("\n");
    // 180 ns against 160 by the law
    assert!(
        text.contains(
            "3 µs (50000 faces, edges of 3.00 mm) to 4 µs (50000 faces, edges of 0.10 mm)"
        ),
        "{text}"
    );
    assert!(
        text.contains("at most 40 µs in p99.9 (50000 faces, edges of 0.10 mm)"),
        "{text}"
    );
    assert!(
        text.contains("takes 2 (50000 faces, edges of 3.00 mm) to 20 times (50000 faces, edges of 0.10 mm) a whole"),
        "{text}"
    );
    assert!(
        text.contains("0.18 µs instead of 0.10 µs (1.12 times what the logarithmic law"),
        "{text}"
    );
    assert!(
        text.contains("at most 1.020 times as long") && text.contains("within the 1.05"),
        "{text}"
    );
    assert!(
        text.contains("guard +120 ns, contact +1 ns (within the noise)"),
        "{text}"
    );
    assert!(
        text.contains("800000 samples per second, scene cheapest, edges of 1.00 mm (holds 500000)"),
        "{text}"
    );
    assert!(
        text.contains("400000 samples per second, scene default, edges of 1.00 mm (misses 500000)"),
        "{text}"
    );
    assert!(text.contains("never asks for memory"), "{text}");
    cost.sizes[1].barest_to_minimal = 1.2.into();
    cost.parts[0].with.allocations = Some(0.5);
    let text = cost.chapter().text.join("\n");
    assert!(
        text.contains("at most 1.200 times as long") && text.contains("this misses the 1.05"),
        "{text}"
    );
    assert!(text.contains("asks 5.00e-1 times for memory"), "{text}");
}

#[test]
fn the_law_is_drawn_dashed_beside_what_was_measured() {
    let chapter = made_up().chapter();
    let figure = chapter
        .figures
        .iter()
        .find(|figure| figure.id == "cheapest_push_by_faces")
        .unwrap();
    let curves = curves_of(figure);
    assert_eq!(curves.len(), 4);
    let law = &curves[3];
    assert_eq!(law.stroke, LineStroke::Dashed);
    let at: Vec<_> = law
        .marks
        .iter()
        .map(|mark| (mark.x.median, (mark.y.median * 1e6).round()))
        .collect();
    assert_eq!(
        at,
        [(1e4, 100e3), (1e5, 130e3), (1e6, 160e3)],
        "0.10, 0.13 and 0.16 µs"
    );
    for table in &chapter.tables {
        assert!(
            table.rows.iter().all(|row| row.len() == table.heads.len()),
            "{}",
            table.id
        );
    }
    let parts = chapter
        .tables
        .iter()
        .find(|table| table.id == "push_by_part")
        .unwrap();
    assert_eq!(parts.rows[0][0], TableCell::Text("guard".to_owned()));
}

#[test]
fn recordings_are_drawn_against_edge_and_faces_beside_the_peer() {
    let chapter = made_up().chapter();
    let [edge, faces] = ["push_time_by_edge", "push_time_by_faces"].map(|id| {
        let figure = chapter
            .figures
            .iter()
            .find(|figure| figure.id == id)
            .unwrap();
        assert!(
            [&figure.x, &figure.y]
                .iter()
                .all(|axis| axis.scale == Scale::Log),
            "{id}"
        );
        let series = curves_of(figure).iter().map(|curve| {
            let marks = curve
                .marks
                .iter()
                .map(|mark| [mark.x.median, mark.y.median].map(|at| (at * 1e3).round()));
            (curve.name.as_str(), marks.collect::<Vec<_>>())
        });
        series.collect::<Vec<_>>()
    });
    assert_eq!(
        edge[0],
        ("push, median", vec![[100.0, 4000.0], [3000.0, 3000.0]])
    );
    assert_eq!(
        edge[2],
        ("push, p99.9", vec![[100.0, 40e3], [3000.0, 30e3]])
    );
    assert_eq!(
        edge[4],
        ("index of parry3d", vec![[100.0, 80e3], [3000.0, 6000.0]])
    );
    assert_eq!(
        faces[3],
        ("end to end, 1.00 mm", vec![[10e6, 5000.0], [100e6, 5000.0]])
    );
    assert_eq!(faces.len(), 5);
}

/// A wrong index of the peer would make its timing worthless.
#[test]
fn the_index_of_the_peer_stays_exact() {
    let mut peer = ParryLoop::new(wavy_plate(50_000).unwrap());
    for i in 0..1_000 {
        let sample = slide(i, 0.2);
        assert!(peer.push(&sample).is_some());
        // a vertex less than 1.5 mm from the touch in edges of 1.9 mm, beside the corners of the
        // face
        assert!(
            (3..=6).contains(&peer.moved_vertices().len()),
            "{:?}",
            peer.moved_vertices()
        );
    }
    let tree = FaceTree::new(&peer.mesh);
    for i in (0..1_000).step_by(7) {
        let p = slide(i, 0.2).pose_ot.translation.vector.into();
        let [found, closest] = [
            peer.closest(&p).unwrap().1,
            tree.closest(&peer.mesh, &p, 0.01).unwrap().point,
        ]
        .map(|q| (q - p).norm());
        assert!(
            (found - closest).abs() <= 1e-12 * closest,
            "{found} and {closest} at sample {i}"
        );
    }
}

/// The ratio of two that do different work would say nothing: both move three corners with each
/// sample, and about as far.
#[test]
fn the_cheapest_scene_moves_the_mesh_as_the_hand_written_loop_does() {
    let scan = wavy_plate(20_000).unwrap();
    let params = Scene::from_yaml(BAREST)
        .unwrap()
        .refine_params(WrenchFrame::Object)
        .unwrap();
    let mut refiner = Refiner::new(scan.clone(), params).unwrap();
    let (mut minimal, mut keeping) = (
        MinimalLoop::new(scan.clone()),
        MinimalLoop::keeping(scan.clone()),
    );
    for i in 0..3_000 {
        let sample = slide(i, 0.2);
        assert!(minimal.push(&sample) && keeping.push(&sample));
        refiner.push(&sample).unwrap();
        assert_eq!(refiner.moved_vertices().len(), 3);
    }
    let displacement = |mesh: &TriMesh| {
        let moved = mesh
            .positions()
            .iter()
            .zip(scan.positions())
            .map(|(now, before)| (now - before).norm());
        moved.sum::<f64>()
    };
    let [by_loop, by_scene] = [&minimal.mesh, refiner.mesh()].map(displacement);
    println!("vertices moved by {by_loop:.3e} m and {by_scene:.3e} m in all");
    assert!(
        by_loop > 1e-3 && (0.8..1.25).contains(&(by_scene / by_loop)),
        "{by_scene} and {by_loop}"
    );
    // the two loops differ only in finding the face and in the boxes
    assert_eq!(minimal.mesh.positions(), keeping.mesh.positions());
    let p = slide(1_500, 0.2).pose_ot.translation.vector.into();
    assert_eq!(
        refiner.closest_face(&p, 0.01),
        FaceTree::new(refiner.mesh()).closest(refiner.mesh(), &p, 0.01)
    );
}

#[test]
#[ignore = "a slow proof"]
fn the_small_measurement_measures_every_part() {
    let mut lines = Vec::new();
    let began = std::time::Instant::now();
    let cost = cost(Effort { is_quick: true }, &mut |line| {
        println!("{:6.1} s {line}", began.elapsed().as_secs_f64());
        lines.push(line.to_owned());
    })
    .unwrap();
    println!("{:6.1} s", began.elapsed().as_secs_f64());
    let chapter = cost.chapter();
    println!("{}", chapter.text.join("\n"));
    for table in &chapter.tables {
        println!("{}\n{}", table.title, table.heads.join(" | "));
        for row in &table.rows {
            let cells: Vec<_> = row
                .iter()
                .map(|cell| serde_json::to_string(cell).unwrap())
                .collect();
            println!("{}", cells.join(" | "));
        }
    }
    assert!(lines.len() >= 5 && lines.iter().all(|line| line.starts_with("cost: ")));
    let faces: Vec<_> = cost.sizes.iter().map(|size| size.faces).collect();
    assert!(faces.is_sorted() && faces.len() == 3, "{faces:?}");
    let names: Vec<_> = cost
        .parts
        .iter()
        .take(7)
        .map(|part| part.part.as_str())
        .collect();
    let by_hand = [
        "contact",
        "sliding",
        "carve",
        "guard",
        "compensation",
        "bias_tracking",
        "undo of strokes",
    ];
    assert_eq!(names, by_hand);
    assert!(
        cost.replays
            .iter()
            .all(|replay| replay.samples_per_s.median > 0.0)
            && cost.replays.len() == 6
    );
    assert_eq!((cost.by_edge.len(), cost.by_faces.len()), (5, 4));
    for recording in cost.by_edge.iter().chain(&cost.by_faces) {
        let RecordingCost { push, peer, .. } = recording;
        assert!(
            push.median > 0
                && push.median <= push.p999
                && peer.median > 0
                && recording.whole_us > 0.0
        );
        assert!(recording.peer_moves >= 3.0, "{recording:?}");
    }
    assert!(asked().is_some());
    for size in &cost.sizes {
        assert_eq!(size.barest.allocations, Some(0.0), "{} faces", size.faces);
    }
}
