//! The chapter: one table of times and ratios, one figure, and the two promises.

use super::{AGREEMENT, Peers, PeersAtSize, WANTED_FACTOR};
use crate::{Axis, Chapter, Drawing, Figure, LineStroke, Mark, Series, Spread, Table, TableCell};

impl Peers {
    /// The table and its text.
    pub fn chapter(&self) -> Chapter {
        let how = "The same wavy plate, the same point sliding over it at 50 mm/s and 1 kHz, one thread on one processor, one run: touchup before \
                   the peers and after them. A peer's pipeline finds the closest face, moves the vertices around it, and brings its index up \
                   to date by the cheapest method that leaves it exact; touchup's push does that and filters, gates, solves the dynamics and \
                   guards the mesh. Of both turns of touchup the slower counts.";
        let text = std::iter::once(how.to_owned()).chain(self.sizes.iter().flat_map(verdicts)).collect();
        Chapter { title: "Against peers".to_owned(), text, figures: vec![figure(self)], tables: vec![table(self)] }
    }
}

fn verdicts(size: &PeersAtSize) -> Vec<String> {
    let pipeline = size.fastest_pipeline().zip(size.pipeline_factor()).map(|(peer, factor)| {
        let verdict = if factor >= WANTED_FACTOR { "holds" } else { "MISSES" };
        format!(
            "a push is {factor:.0} times faster than the fastest pipeline with an exact index ({}, {:.0} µs): {verdict} the wanted \
             {WANTED_FACTOR:.0}.",
            peer.peer, peer.pipeline_us.median
        )
    });
    let query = size.fastest_query().zip(size.query_factor()).map(|(peer, factor)| {
        let verdict = if factor > 1.0 { "holds" } else { "MISSES" };
        let (push, query) = (size.push_us(), peer.query_us.median);
        format!(
            "a whole push takes {push:.2} µs, the fastest closest-face query alone {query:.2} µs ({}), {factor:.1} times as long: \
             {verdict}.",
            peer.peer
        )
    });
    let differing = size.peers.iter().filter(|peer| !peer.agrees()).filter_map(|peer| {
        let (name, difference) = (&peer.peer, peer.largest_difference?);
        Some(format!("{name} differs from touchup's distances by up to {difference:.1e}, more than {AGREEMENT:.0e}."))
    });
    let failed = size.failed.iter().map(|one| format!("{} could not be measured: {}.", one.peer, one.error));
    let all = pipeline.into_iter().chain(query).chain(differing).chain(failed);
    all.map(|text| format!("{} faces: {text}", size.faces)).collect()
}

/// A turn of touchup, or a peer.
struct Row<'a> {
    faces: usize,
    who: String,
    update: &'a str,
    query_us: Spread,
    next_query_us: Option<Spread>,
    sample_us: Spread,
    ratio: Option<f64>,
    difference: TableCell,
}

fn rows(size: &PeersAtSize) -> Vec<Row<'_>> {
    let ours = ["touchup, before", "touchup, after"].into_iter().zip(&size.touchup).map(|(name, times)| Row {
        faces: size.faces,
        who: name.to_owned(),
        update: "boxes of the moved faces refitted",
        query_us: times.query_us,
        next_query_us: Some(times.next_query_us),
        sample_us: times.push_us,
        ratio: None,
        difference: TableCell::Empty,
    });
    let peers = size.peers.iter().map(|peer| Row {
        faces: size.faces,
        who: format!("{} ({})", peer.peer, peer.versions),
        update: &peer.update,
        query_us: peer.query_us,
        next_query_us: peer.batched_query_us,
        sample_us: peer.pipeline_us,
        ratio: Some(peer.pipeline_us.median / size.push_us()),
        difference: peer.largest_difference.map_or("another question (Eq 12)".into(), TableCell::Number),
    });
    ours.chain(peers).collect()
}

fn table(peers: &Peers) -> Table {
    let rows: Vec<Row> = peers.sizes.iter().flat_map(rows).collect();
    let caption = "Medians with p10 to p90, one thread. A rebuild is measured over four seconds.";
    Table::of("peers", "Closest face and whole sample against libraries from PyPI", caption, &rows)
        .column("faces", |row| row.faces)
        .column("who", |row| row.who.as_str())
        .column("how the index is kept true", |row| row.update)
        .column("closest face per call, µs", |row| row.query_us)
        .column("closest face in one call for all (touchup: near the last), µs", |row| row.next_query_us)
        .column("whole sample, µs", |row| row.sample_us)
        .column("sample over touchup's push", |row| row.ratio)
        .column("largest relative difference of a distance", |row| row.difference.clone())
        .table
}

fn figure(peers: &Peers) -> Figure {
    let mut series: Vec<Series> = Vec::new();
    let mut add = |name: &str, faces: usize, y: Spread| {
        let mark = Mark::at(faces as f64, y);
        match series.iter_mut().find(|known| known.name == name) {
            Some(known) => known.marks.push(mark),
            None => series.push(Series::new(name, LineStroke::Joined, [mark])),
        }
    };
    for size in &peers.sizes {
        add("touchup", size.faces, size.touchup[0].push_us);
        for peer in &size.peers {
            add(&peer.peer, size.faces, peer.pipeline_us);
        }
    }
    Figure {
        id: "peers_sample".to_owned(),
        title: "Time per sample with an index that stays exact".to_owned(),
        caption: "Medians with p10 to p90, one thread; touchup: whole push, before the peers.".to_owned(),
        x: Axis::log("faces", "faces"),
        y: Axis::log("time per sample, µs", "sample_us"),
        drawing: Drawing::Curves(series),
    }
}
