//! The chapter: one table of times and ratios, one figure, and the two promises.

use super::{AGREEMENT, Peers, PeersAtSize, WANTED_FACTOR};
use crate::{Axis, Chapter, Figure, Mark, Series, Spread, Table, TableCell};

impl Peers {
    /// The table and its text.
    pub fn chapter(&self) -> Chapter {
        let how = "The same wavy plate, the same point sliding over it at 50 mm/s and 1 kHz, one thread on one processor, one run: touchup before \
                   the peers and after them. A peer's pipeline finds the closest face, moves the vertices around it, and brings its index up \
                   to date by the cheapest method that leaves it exact; touchup's push does that and filters, gates, solves the dynamics and \
                   guards the mesh. Of both turns of touchup the slower counts.";
        let text = std::iter::once(how.to_owned())
            .chain(self.sizes.iter().flat_map(verdicts))
            .collect();
        Chapter::of("Against peers", text, vec![figure(self)], vec![table(self)])
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
    let failed = size.failed.iter();
    let failed = failed.map(|one| format!("{} could not be measured: {}.", one.peer, one.error));
    let all = pipeline
        .into_iter()
        .chain(query)
        .chain(differing)
        .chain(failed);
    all.map(|text| format!("{} faces: {text}", size.faces))
        .collect()
}

fn table(peers: &Peers) -> Table {
    // with touchup's push for comparison
    let rows = peers.sizes.iter().flat_map(|size| {
        let ours = size
            .touchup
            .iter()
            .map(move |times| (size.faces, None, times));
        let peers = size.peers.iter();
        ours.chain(peers.map(move |times| (size.faces, Some(size.push_us()), times)))
    });
    let batched = "closest face in one call for all (touchup: near the last), µs";
    Table::of(
        "peers",
        "Closest face and whole sample against libraries from PyPI",
        rows,
    )
    .column("faces", |(faces, ..)| faces)
    .column("who", |(_, push_us, times)| match push_us {
        None => times.peer.clone(),
        Some(_) => format!("{} ({})", times.peer, times.versions),
    })
    .column("how the index is kept true", |(.., times)| {
        times.update.as_str()
    })
    .column("closest face per call, µs", |(.., times)| times.query_us)
    .column(batched, |(.., times)| times.batched_query_us)
    .column("whole sample, µs", |(.., times)| times.pipeline_us)
    .column("sample over touchup's push", |(_, push_us, times)| {
        Some(times.pipeline_us.median / push_us?)
    })
    .column(
        "largest relative difference of a distance",
        |(_, push_us, times)| {
            push_us?;
            let other = || "another question (Eq 12)".into();
            Some(
                times
                    .largest_difference
                    .map_or_else(other, TableCell::Number),
            )
        },
    )
    .caption("Medians with p10 to p90, one thread. A rebuild is measured over four seconds.")
}

fn figure(peers: &Peers) -> Figure {
    let mut series: Vec<Series> = Vec::new();
    let mut add = |name: &str, faces: usize, y: Spread| {
        let mark = Mark::at(faces as f64, y);
        match series.iter_mut().find(|known| known.name == name) {
            Some(known) => known.marks.push(mark),
            None => series.push(Series::joined(name, [mark])),
        }
    };
    for size in &peers.sizes {
        add("touchup", size.faces, size.touchup[0].pipeline_us);
        for peer in &size.peers {
            add(&peer.peer, size.faces, peer.pipeline_us);
        }
    }
    Figure::curves("peers_sample", series)
        .title("Time per sample with an index that stays exact")
        .axes(
            Axis::log("faces", "faces"),
            Axis::log("time per sample, µs", "sample_us"),
        )
        .caption("Medians with p10 to p90, one thread; touchup: whole push, before the peers.")
}
