//! Other participants on our topics, and reasons for their mismatches. r2r reports nothing by
//! itself, so this queries it once per second; of listeners it knows only the number.

use std::time::{Duration, Instant};

use r2r::qos::{DurabilityPolicy, QosProfile, ReliabilityPolicy};
use r2r::{Context, Node, Publisher, WrappedTypesupport};

use crate::ros::exchange::PortState;
use crate::ros::port::Arrival;

/// Period of the queries.
const PERIOD: Duration = Duration::from_secs(1);

/// Number of fitting participants, and reason of a mismatch.
type EndpointMatch = (usize, Option<String>);

type GraphQuery = Box<dyn Fn(&Node) -> r2r::Result<EndpointMatch> + Send>;

struct WatchedTopic {
    topic: String,
    /// listeners are viewers
    is_mesh: bool,
    look: GraphQuery,
    reported: EndpointMatch,
}

pub(super) struct R2rGraph {
    context: Context,
    watched: Vec<WatchedTopic>,
    looked: Instant,
}

impl R2rGraph {
    pub fn new(context: Context) -> Self {
        Self {
            context,
            watched: Vec::new(),
            looked: Instant::now(),
        }
    }

    /// Watches a published topic.
    ///
    /// - `topic`: absolute, remapped.
    /// - `is_mesh`: topic of the tiles.
    pub fn watch_listeners<T>(&mut self, topic: String, is_mesh: bool, publisher: Publisher<T>)
    where
        T: WrappedTypesupport + 'static,
    {
        let look: GraphQuery =
            Box::new(move |_| Ok((publisher.get_inter_process_subscription_count()?, None)));
        self.watched.push(WatchedTopic {
            topic,
            is_mesh,
            look,
            reported: (0, None),
        });
    }

    /// Watches a subscribed topic.
    ///
    /// - `topic`: absolute, remapped.
    pub fn watch_senders(&mut self, topic: String, type_name: &'static str, wanted: QosProfile) {
        let name = topic.clone();
        let look: GraphQuery = Box::new(move |node| {
            let senders = node.get_publishers_info_by_topic(&name, false)?;
            let misfits = senders.iter().map(|sender| {
                misfit(type_name, &wanted, &sender.topic_type, &sender.qos_profile)
                    .map(|reason| format!("what {} sends does not fit: {reason}", sender.node_name))
            });
            let misfits: Vec<String> = misfits.flatten().collect();
            Ok((senders.len() - misfits.len(), misfits.into_iter().next()))
        });
        self.watched.push(WatchedTopic {
            topic,
            is_mesh: false,
            look,
            reported: (0, None),
        });
    }

    /// Reports changes, if a query is due; returns whether ROS is still present.
    pub fn look(&mut self, node: &Node, exchange: &PortState) -> bool {
        if self.looked.elapsed() < PERIOD {
            return true;
        }
        self.looked = Instant::now();
        for WatchedTopic {
            topic,
            is_mesh,
            look,
            reported,
        } in &mut self.watched
        {
            let seen = look(node);
            if let (true, Ok((viewers, _))) = (*is_mesh, &seen) {
                exchange.inbox.put(Arrival::Viewers(*viewers));
            }
            match seen {
                Ok(seen) if seen != *reported => {
                    exchange.inbox.report(topic.clone(), seen.0, seen.1.clone());
                    *reported = seen;
                }
                Ok(_) => {}
                Err(error) => tracing::debug!(topic, %error, "nobody knows who is on a topic"),
            }
        }
        self.context.is_valid()
    }
}

/// Reason why messages do not reach a listener.
fn misfit(
    wanted_type: &str,
    wanted: &QosProfile,
    type_name: &str,
    offered: &QosProfile,
) -> Option<String> {
    if type_name != wanted_type {
        return Some(format!(
            "it has the type {type_name}, here it is {wanted_type}"
        ));
    }
    let best_effort = ReliabilityPolicy::BestEffort;
    if wanted.reliability == ReliabilityPolicy::Reliable && offered.reliability == best_effort {
        return Some("reliable is wanted here, it offers best effort".to_owned());
    }
    let volatile = DurabilityPolicy::Volatile;
    if wanted.durability == DurabilityPolicy::TransientLocal && offered.durability == volatile {
        return Some("transient local is wanted here, it offers volatile".to_owned());
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn senders_fit_as_the_rules_of_dds_say() {
        let [best_effort, reliable] = [QosProfile::sensor_data(), QosProfile::default()];
        let latched = QosProfile::default().transient_local();
        let wrench = "geometry_msgs/msg/WrenchStamped";
        let cases = [
            (wrench, &best_effort, &best_effort, None),
            (wrench, &best_effort, &reliable, None),
            (wrench, &best_effort, &latched, None),
            (wrench, &reliable, &latched, None),
            (wrench, &latched, &latched, None),
            (
                wrench,
                &reliable,
                &best_effort,
                Some("reliable is wanted here, it offers best effort"),
            ),
            (
                wrench,
                &latched,
                &reliable,
                Some("transient local is wanted here, it offers volatile"),
            ),
            (
                "geometry_msgs/msg/Wrench",
                &best_effort,
                &reliable,
                Some(
                    "it has the type geometry_msgs/msg/Wrench, here it is geometry_msgs/msg/WrenchStamped",
                ),
            ),
        ];
        for (sent, wanted, offered, reason) in cases {
            assert_eq!(
                misfit(wrench, wanted, sent, offered).as_deref(),
                reason,
                "{wanted:?} {offered:?}"
            );
        }
    }
}
