//! The chapter: one table of times and ratios, one figure, and the two promises.

use super::{AGREEMENT, PeerTimes, Peers, PeersAtSize, TouchupTimes, WANTED_FACTOR};
use crate::{Axis, Chapter, Drawing, Figure, LineStroke, Mark, Series, Spread, Table, TableCell};

pub(super) fn chapter(peers: &Peers) -> Chapter {
    let how = "The same wavy plate, the same point sliding over it at 50 mm/s and 1 kHz, one thread on one processor, one run: touchup before \
               the peers and after them. A peer's pipeline finds the closest face, moves the vertices around it, and brings its index up \
               to date by the cheapest method that leaves it exact; touchup's push does that and filters, gates, solves the dynamics and \
               guards the mesh. Of both turns of touchup the slower counts.";
    let mut text = vec![how.to_owned()];
    text.extend(peers.sizes.iter().flat_map(verdicts));
    Chapter { title: "Against peers".to_owned(), text, figures: vec![figure(peers)], tables: vec![table(peers)] }
}

fn verdicts(size: &PeersAtSize) -> Vec<String> {
    let mut text = Vec::new();
    if let (Some(peer), Some(factor)) = (size.fastest_pipeline(), size.pipeline_factor()) {
        let verdict = if factor >= WANTED_FACTOR { "holds" } else { "MISSES" };
        text.push(format!(
            "{} faces: a push is {factor:.0} times faster than the fastest pipeline with an exact index ({}, {:.0} µs): {verdict} the \
             wanted {WANTED_FACTOR:.0}.",
            size.faces, peer.peer, peer.pipeline_us.median
        ));
    }
    if let (Some(peer), Some(factor)) = (size.fastest_query(), size.query_factor()) {
        let verdict = if factor > 1.0 { "holds" } else { "MISSES" };
        text.push(format!(
            "{} faces: a whole push takes {:.2} µs, the fastest closest-face query alone {:.2} µs ({}), {factor:.1} times as long: {verdict}.",
            size.faces,
            size.push_us(),
            peer.query_us.median,
            peer.peer
        ));
    }
    let others: Vec<_> = size.peers.iter().filter(|peer| peer.largest_difference.is_some() && !peer.agrees()).collect();
    for peer in others {
        let difference = peer.largest_difference.unwrap_or(f64::NAN);
        text.push(format!(
            "{} faces: {} differs from touchup's distances by up to {difference:.1e}, more than {AGREEMENT:.0e}.",
            size.faces, peer.peer
        ));
    }
    text.extend(
        size.failed
            .iter()
            .map(|failed| format!("{} faces: {} could not be measured: {}.", size.faces, failed.peer, failed.error)),
    );
    text
}

fn touchup_row(faces: usize, name: &str, times: &TouchupTimes) -> Vec<TableCell> {
    vec![
        TableCell::Number(faces as f64),
        name.into(),
        "boxes of the moved faces refitted".into(),
        times.query_us.into(),
        times.next_query_us.into(),
        times.push_us.into(),
        TableCell::Empty,
        TableCell::Empty,
    ]
}

fn peer_row(size: &PeersAtSize, peer: &PeerTimes) -> Vec<TableCell> {
    vec![
        TableCell::Number(size.faces as f64),
        format!("{} ({})", peer.peer, peer.versions).into(),
        peer.update.clone().into(),
        Spread::from(peer.query_us).into(),
        peer.batched_query_us.map_or(TableCell::Empty, |us| Spread::from(us).into()),
        Spread::from(peer.pipeline_us).into(),
        TableCell::Number(peer.pipeline_us.median / size.push_us()),
        peer.largest_difference.map_or("another question (Eq 12)".into(), TableCell::Number),
    ]
}

fn table(peers: &Peers) -> Table {
    let rows = peers.sizes.iter().flat_map(|size| {
        let ours = ["touchup, before", "touchup, after"].into_iter().zip(&size.touchup);
        let ours = ours.map(|(name, times)| touchup_row(size.faces, name, times));
        ours.chain(size.peers.iter().map(|peer| peer_row(size, peer)))
    });
    let heads = [
        "faces",
        "who",
        "how the index is kept true",
        "closest face per call, µs",
        "closest face in one call for all (touchup: near the last), µs",
        "whole sample, µs",
        "sample over touchup's push",
        "largest relative difference of a distance",
    ];
    Table {
        id: "peers".to_owned(),
        title: "Closest face and whole sample against libraries from PyPI".to_owned(),
        caption: "Medians with p10 to p90, one thread. A rebuild is measured over four seconds.".to_owned(),
        heads: heads.map(str::to_owned).to_vec(),
        rows: rows.collect(),
    }
}

fn figure(peers: &Peers) -> Figure {
    let mut series: Vec<Series> = Vec::new();
    let mut add = |name: &str, faces: usize, y: Spread| {
        let mark = Mark { x: (faces as f64).into(), y };
        match series.iter_mut().find(|known| known.name == name) {
            Some(known) => known.marks.push(mark),
            None => series.push(Series { name: name.to_owned(), stroke: LineStroke::Joined, marks: vec![mark] }),
        }
    };
    for size in &peers.sizes {
        add("touchup", size.faces, size.touchup[0].push_us);
        for peer in &size.peers {
            add(&peer.peer, size.faces, peer.pipeline_us.into());
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
