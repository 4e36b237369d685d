//! The cost of a push in the report: the text from the numbers, and that both sides of the ratio do the same work.

use touchup_core::haptic::Refiner;
use touchup_core::mesh::{FaceTree, TriMesh};
use touchup_core::stylus::WrenchFrame;
use touchup_report::allocations::asked;
use touchup_report::cost::{
    BAREST, Cost, LogLaw, MinimalLoop, PartCost, PerSample, ReplaySpeed, SizeCost, StageCost, cost,
};
use touchup_report::{Drawing, Effort, LineStroke, Spread, TableCell};
use touchup_session::scene::Scene;
use touchup_sim::wavy::{slide, wavy_plate};

fn ns(median: f64) -> PerSample {
    PerSample {
        time_ns: Spread { median, p10: 0.9 * median, p90: 1.2 * median },
        allocations: Some(0.0),
        allocated_bytes: None,
    }
}

/// 100 ns at 10k faces, 30 ns more for ten times as many, and 20 ns of the caches at a million.
fn made_up() -> Cost {
    let size = |faces: usize, push: f64, ratio: f64| SizeCost {
        faces,
        minimal: ns(push / ratio),
        barest: ns(push),
        barest_to_minimal: ratio.into(),
        keeping: ns(push / 1.3),
        barest_to_keeping: 1.3.into(),
        default_finer: ns(10.0 * push),
        moved_finer: faces as f64 / 1e3,
        default_larger: ns(4.0 * push),
        mesh_bytes_per_face: 60.0,
        tree_bytes_per_face: 40.0,
        tree_build_ms: 1.0,
    };
    let sizes = vec![size(10_000, 100.0, 0.9), size(100_000, 130.0, 1.02), size(1_000_000, 180.0, 0.8)];
    let law = |times: f64| LogLaw::fit(&[(10_000, times * 100.0), (100_000, times * 130.0)]);
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
    Cost {
        sizes,
        barest_law: law(1.0),
        default_law: law(4.0),
        parts: vec![part("guard", 520.0, 400.0), part("contact", 521.0, 520.0)],
        stages: vec![StageCost { stage: "sync".to_owned(), faces: 100_000, per_sample: ns(70.0) }],
        seldom: Vec::new(),
        replays: vec![replay("cheapest", 800_000.0), replay("default", 400_000.0)],
    }
}

#[test]
fn the_text_reports_hits_and_misses_as_measured() {
    let mut cost = made_up();
    let text = cost.chapter().text.join("\n");
    // 180 ns where the law says 160
    assert!(text.contains("0.18 µs instead of 0.10 µs (1.12 times what the logarithmic law"), "{text}");
    assert!(text.contains("at most 1.020 times as long") && text.contains("within the 1.05"), "{text}");
    assert!(text.contains("guard +120 ns, contact +1 ns (within the noise)"), "{text}");
    assert!(text.contains("800000 samples per second, scene cheapest, edges of 1.00 mm (holds 500000)"), "{text}");
    assert!(text.contains("400000 samples per second, scene default, edges of 1.00 mm (misses 500000)"), "{text}");
    assert!(text.contains("never asks for memory"), "{text}");
    cost.sizes[1].barest_to_minimal = 1.2.into();
    cost.sizes[2].default_finer.allocations = Some(0.5);
    let text = cost.chapter().text.join("\n");
    assert!(text.contains("at most 1.200 times as long") && text.contains("this misses the 1.05"), "{text}");
    assert!(text.contains("asks 5.00e-1 times for memory"), "{text}");
}

#[test]
fn the_law_is_drawn_dashed_beside_what_was_measured() {
    let chapter = made_up().chapter();
    let Drawing::Curves(curves) = &chapter.figures[0].drawing else { panic!("curves are drawn") };
    assert_eq!(curves.len(), 6);
    let law = &curves[4];
    assert_eq!(law.stroke, LineStroke::Dashed);
    let at: Vec<_> = law.marks.iter().map(|mark| (mark.x.median, (mark.y.median * 1e6).round())).collect();
    assert_eq!(at, [(1e4, 100e3), (1e5, 130e3), (1e6, 160e3)], "0.10, 0.13 and 0.16 µs");
    for table in &chapter.tables {
        assert!(table.rows.iter().all(|row| row.len() == table.heads.len()), "{}", table.id);
    }
    assert_eq!(chapter.tables[1].rows[0][0], TableCell::Text("guard".to_owned()));
}

/// The ratio of two that do different work would say nothing: both move three corners with each sample, and about as far.
#[test]
fn the_cheapest_scene_moves_the_mesh_as_the_hand_written_loop_does() {
    let scan = wavy_plate(20_000).unwrap();
    let params = Scene::from_yaml(BAREST).unwrap().refine_params(WrenchFrame::Object).unwrap();
    let mut refiner = Refiner::new(scan.clone(), params).unwrap();
    let (mut minimal, mut keeping) = (MinimalLoop::new(scan.clone()), MinimalLoop::keeping(scan.clone()));
    for i in 0..3_000 {
        let sample = slide(i, 0.2);
        assert!(minimal.push(&sample) && keeping.push(&sample));
        refiner.push(&sample).unwrap();
        assert_eq!(refiner.moved_vertices().len(), 3);
    }
    let displacement = |mesh: &TriMesh| {
        let moved = mesh.positions().iter().zip(scan.positions()).map(|(now, before)| (now - before).norm());
        moved.sum::<f64>()
    };
    let [by_loop, by_scene] = [&minimal.mesh, refiner.mesh()].map(displacement);
    println!("vertices moved by {by_loop:.3e} m and {by_scene:.3e} m in all");
    assert!(by_loop > 1e-3 && (0.8..1.25).contains(&(by_scene / by_loop)), "{by_scene} and {by_loop}");
    // the two loops differ in how they find the face and the boxes alone
    assert_eq!(minimal.mesh.positions(), keeping.mesh.positions());
    let p = slide(1_500, 0.2).pose_ot.translation.vector.into();
    assert_eq!(refiner.closest_face(&p, 0.01), FaceTree::new(refiner.mesh()).closest(refiner.mesh(), &p, 0.01));
}

#[test]
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
            let cells: Vec<_> = row.iter().map(|cell| serde_json::to_string(cell).unwrap()).collect();
            println!("{}", cells.join(" | "));
        }
    }
    assert!(lines.len() >= 5 && lines.iter().all(|line| line.starts_with("cost: ")));
    let faces: Vec<_> = cost.sizes.iter().map(|size| size.faces).collect();
    assert!(faces.is_sorted() && faces.len() == 3, "{faces:?}");
    let names: Vec<_> = cost.parts.iter().take(7).map(|part| part.part.as_str()).collect();
    let by_hand = ["contact", "sliding", "carve", "guard", "compensation", "bias_tracking", "undo of strokes"];
    assert_eq!(names, by_hand);
    assert!(cost.replays.iter().all(|replay| replay.samples_per_s.median > 0.0) && cost.replays.len() == 6);
    assert!(asked().is_some());
    for size in &cost.sizes {
        assert_eq!(size.barest.allocations, Some(0.0), "{} faces", size.faces);
    }
}
