//! Places for pages: so many are open at a time, and each is counted.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use super::site::Site;

/// Pages at a time at most.
const MOST_PAGES: usize = 16;

/// One of the pages at a time; free again when it is dropped.
pub(super) struct PagePlace(Arc<Site>);

impl PagePlace {
    /// Takes a place; `None`: there is none left.
    pub fn take(site: &Arc<Site>) -> Option<Self> {
        let is_there = |count: usize| (count < MOST_PAGES).then_some(count + 1);
        let taken = site
            .pages
            .fetch_update(Ordering::Relaxed, Ordering::Relaxed, is_there);
        taken.is_ok().then(|| Self(Arc::clone(site)))
    }
}

impl Drop for PagePlace {
    fn drop(&mut self) {
        let pages: &AtomicUsize = &self.0.pages;
        pages.fetch_sub(1, Ordering::Relaxed);
    }
}
