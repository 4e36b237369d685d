mod friction;
mod latency;
mod markers;
mod samples;
mod sync_in_order;
