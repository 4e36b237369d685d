//! The action `~/probe`: three services and two topics, and the known goals.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

use byteorder::LittleEndian;
use ros2_client::action::{
    ActionServerQosPolicies, CancelGoalRequest, CancelGoalResponse, GetResultResponse, GoalId,
    GoalInfo, GoalStatusEnum, SendGoalRequest, SendGoalResponse,
};
use ros2_client::action_msgs::{CancelGoalResponseEnum, GoalStatus, GoalStatusArray};
use ros2_client::builtin_interfaces::Time;
use ros2_client::dds::rustdds::mio1::event::Source;
use ros2_client::qos::{Durability, History};
use ros2_client::{ActionServer, ActionTypeName, RmwRequestId, WriteError};

use super::answers::Room;
use super::back_end::{DdsBackEnd, DdsErrorContext};
use super::graph::mapping;
use super::incoming::{Listener, drain};
use super::services::{OTHER_MAPPING, SERVICE};
use super::topics::dds_name;
use crate::ros::exchange::{PortState, RosError};
use crate::ros::locked;
use crate::ros::messages::{ProbeFeedback, ProbeGoal, ProbeResponse};
use crate::ros::port::{ArmOrder, Call, Feedback, Goal, GoalEnd, Reply};
use crate::ros::services::PROBE;

/// Maximum number of remembered goals; the oldest finished ones go first.
const MOST_GOALS: usize = 32;
/// Maximum number of calls that wait for the result of one goal.
const MOST_WAITING: usize = 16;

type ProbeServer = ActionServer<ProbeGoal, ProbeResponse, ProbeFeedback>;

struct KnownGoal {
    status: GoalStatusEnum,
    accepted: Time,
    number: u64,
    is_cancelled: Arc<AtomicBool>,
    result: Option<ProbeResponse>,
    waiting: Vec<RmwRequestId>,
}

impl KnownGoal {
    fn is_over(&self) -> bool {
        self.result.is_some()
    }
}

#[derive(Default)]
struct Goals {
    known: BTreeMap<GoalId, KnownGoal>,
    next: u64,
}

struct ProbeAction {
    server: ProbeServer,
    exchange: Arc<PortState>,
    room: Arc<Room>,
    goals: Mutex<Goals>,
}

/// The server of the action.
pub(super) fn server(back_end: &mut DdsBackEnd<'_>) -> Result<Box<dyn Listener>, RosError> {
    let DdsBackEnd {
        config,
        node,
        exchange,
        room,
        ..
    } = back_end;
    let latched = SERVICE
        .durability(Durability::TransientLocal)
        .history(History::KeepLast { depth: 1 });
    let qos = ActionServerQosPolicies {
        goal_service: SERVICE,
        result_service: SERVICE,
        cancel_service: SERVICE,
        feedback_publisher: SERVICE,
        status_publisher: latched,
    };
    let name = dds_name(&config.resolve(PROBE)?)?;
    let type_name = ActionTypeName::new("touchup_msgs", "Probe");
    let server = node
        .create_action_server(mapping(config), &name, &type_name, qos)
        .during("offering an action")?;
    let probe = ProbeAction {
        server,
        exchange: exchange.clone(),
        room: room.clone(),
        goals: Mutex::default(),
    };
    Ok(Box::new(Arc::new(probe)))
}

impl Listener for Arc<ProbeAction> {
    fn sources(
        &mut self,
        each: &mut dyn FnMut(&mut dyn Source) -> io::Result<()>,
    ) -> io::Result<()> {
        let probe = Self::get_mut(self).expect("sources are asked for before any goal is there");
        each(probe.server.goal_server())?;
        each(probe.server.cancel_server())?;
        each(probe.server.result_server())
    }

    fn take(&mut self) {
        let (
            probe,
            ProbeAction {
                server, exchange, ..
            },
        ) = (&*self, &**self);
        let what = (PROBE, exchange, OTHER_MAPPING);
        drain(
            what,
            || server.receive_goal(),
            |(id, request)| probe.ask(id, request),
        );
        drain(
            what,
            || server.receive_cancel_request(),
            |(id, request)| probe.cancel(id, &request),
        );
        drain(
            what,
            || server.receive_result_request(),
            |(id, request)| probe.wait_for(id, request.goal_id),
        );
    }
}

impl ProbeAction {
    /// Runs a function on the sending thread.
    fn later(self: &Arc<Self>, send: impl FnOnce(&Self) + Send + 'static) {
        let probe = self.clone();
        self.exchange.urgent.answer(Box::new(move || send(&probe)));
    }

    /// Answers a call, and publishes the status of the goals.
    fn answer(
        self: &Arc<Self>,
        service: &'static str,
        send: impl FnOnce(&ProbeServer) -> Result<(), WriteError<()>> + Send + 'static,
    ) {
        self.later(move |probe| {
            report(service, send(&probe.server));
            probe.publish_status();
        });
    }

    /// Handles a new goal: the node decides.
    fn ask(self: &Arc<Self>, request_id: RmwRequestId, request: SendGoalRequest<ProbeGoal>) {
        let id = request.goal_id;
        let is_cancelled = Arc::new(AtomicBool::new(false));
        if !locked(&self.goals).add(id, is_cancelled.clone()) {
            return self.accept(request_id, id, false);
        }
        let [for_accept, for_feedback, for_result] = [self.clone(), self.clone(), self.clone()];
        let goal = Goal {
            accept: Reply::new(move |is_accepted| for_accept.accept(request_id, id, is_accepted)),
            feedback: Feedback(Box::new(move |feedback| {
                if !locked(&for_feedback.goals).is_running(id) {
                    return;
                }
                for_feedback.later(move |probe| {
                    // nobody waits for a missed feedback
                    let _ = probe.server.send_feedback(id, feedback);
                });
            })),
            result: Reply::new(move |(end, response)| for_result.end(id, end, response)),
            is_cancelled,
        };
        self.exchange
            .inbox
            .call(Call::Arm(ArmOrder::Goal(request.goal, goal)));
    }

    fn accept(self: &Arc<Self>, request_id: RmwRequestId, id: GoalId, accepted: bool) {
        let stamp = Time::now();
        let mut goals = locked(&self.goals);
        match goals.known.get_mut(&id) {
            Some(known) if accepted => {
                (known.status, known.accepted) = (GoalStatusEnum::Executing, stamp)
            }
            // forgets a rejected goal
            Some(known) if known.accepted == Time::ZERO => drop(goals.known.remove(&id)),
            _ => {}
        }
        drop(goals);
        let answer = SendGoalResponse { accepted, stamp };
        self.answer("send_goal", move |server| {
            server.send_goal_response(request_id, answer)
        });
    }

    fn end(self: &Arc<Self>, id: GoalId, end: GoalEnd, response: ProbeResponse) {
        let status = match end {
            GoalEnd::Succeeded => GoalStatusEnum::Succeeded,
            GoalEnd::Canceled => GoalStatusEnum::Canceled,
            GoalEnd::Aborted => GoalStatusEnum::Aborted,
        };
        let mut goals = locked(&self.goals);
        let Some(known) = goals.known.get_mut(&id) else {
            return;
        };
        (known.status, known.result) = (status, Some(response.clone()));
        let waiting = std::mem::take(&mut known.waiting);
        drop(goals);
        self.later(move |probe| {
            for request_id in waiting {
                probe.send_result(request_id, status, response.clone());
            }
            probe.publish_status();
        });
    }

    /// Handles a request for the result of a goal.
    fn wait_for(self: &Arc<Self>, request_id: RmwRequestId, id: GoalId) {
        let (status, response) = match locked(&self.goals).known.get_mut(&id) {
            Some(KnownGoal {
                result: None,
                waiting,
                ..
            }) if waiting.len() < MOST_WAITING => {
                waiting.push(request_id);
                return;
            }
            Some(KnownGoal {
                result: Some(response),
                status,
                ..
            }) => (*status, response.clone()),
            _ => (GoalStatusEnum::Unknown, ProbeResponse::default()),
        };
        self.later(move |probe| probe.send_result(request_id, status, response));
    }

    fn send_result(&self, request_id: RmwRequestId, status: GoalStatusEnum, result: ProbeResponse) {
        let answer = self.room.fit_packet(
            "~/probe/_action/get_result",
            GetResultResponse { status, result },
        );
        report("get_result", self.server.send_result(request_id, answer));
    }

    /// Handles a request to stop goals; the node obeys when it can.
    fn cancel(self: &Arc<Self>, request_id: RmwRequestId, request: &CancelGoalRequest) {
        let response = locked(&self.goals).cancel(wanted(request));
        self.answer("cancel_goal", move |server| {
            server.send_cancel_response(request_id, response)
        });
    }

    fn publish_status(&self) {
        let status = |(id, known): (&GoalId, &KnownGoal)| GoalStatus {
            goal_info: GoalInfo {
                goal_id: *id,
                stamp: known.accepted,
            },
            status: known.status,
        };
        let statuses = GoalStatusArray {
            status_list: locked(&self.goals).known.iter().map(status).collect(),
        };
        if self.server.send_goal_statuses(statuses).is_err() {
            tracing::warn!("the states of the goals are not sent");
        }
    }
}

fn report(service: &str, sent: Result<(), WriteError<()>>) {
    if let Err(error) = sent {
        tracing::warn!(service, %error, "an answer is not sent");
    }
}

/// Content of a request to cancel: the goal (zeros: none), and the time up to which goals count (0:
/// none), ns.
///
/// The fields of that message are private; its bytes are not.
fn wanted(request: &CancelGoalRequest) -> ([u8; 16], i64) {
    let bytes = cdr_encoding::to_vec::<_, LittleEndian>(request).unwrap_or_default();
    let part = |from: usize| {
        bytes
            .get(from..from + 4)
            .and_then(|part| part.try_into().ok())
            .unwrap_or([0; 4])
    };
    let uuid = bytes
        .get(..16)
        .and_then(|part| part.try_into().ok())
        .unwrap_or([0; 16]);
    let (sec, nanosec) = (i32::from_le_bytes(part(16)), u32::from_le_bytes(part(20)));
    (uuid, i64::from(sec) * 1_000_000_000 + i64::from(nanosec))
}

impl Goals {
    /// Adds a goal; false for a known goal or without room.
    fn add(&mut self, id: GoalId, is_cancelled: Arc<AtomicBool>) -> bool {
        if self.known.len() >= MOST_GOALS {
            let over = self.known.iter().filter(|(_, known)| known.is_over());
            let Some(oldest) = over
                .min_by_key(|(_, known)| known.number)
                .map(|(id, _)| *id)
            else {
                return false;
            };
            self.known.remove(&oldest);
        }
        let Entry::Vacant(place) = self.known.entry(id) else {
            return false;
        };
        place.insert(KnownGoal {
            status: GoalStatusEnum::Accepted,
            accepted: Time::ZERO,
            number: self.next,
            is_cancelled,
            result: None,
            waiting: Vec::new(),
        });
        self.next += 1;
        true
    }

    fn is_running(&self, id: GoalId) -> bool {
        self.known.get(&id).is_some_and(|known| !known.is_over())
    }

    /// Cancels as `CancelGoal` says: one goal, all up to a time, both, or all.
    fn cancel(&mut self, (uuid, until_ns): ([u8; 16], i64)) -> CancelGoalResponse {
        let is_named = |id: &GoalId| *id.uuid.as_bytes() == uuid;
        let names_one = uuid != [0; 16];
        let all = !names_one && until_ns == 0;
        let mut goals_canceling = Vec::new();
        for (id, known) in self.known.iter_mut().filter(|(_, known)| !known.is_over()) {
            let is_before = until_ns > 0 && known.accepted.to_nanos() <= until_ns;
            if all || (names_one && is_named(id)) || is_before {
                known.is_cancelled.store(true, Ordering::Relaxed);
                known.status = GoalStatusEnum::Canceling;
                goals_canceling.push(GoalInfo {
                    goal_id: *id,
                    stamp: known.accepted,
                });
            }
        }
        let return_code = match self.known.iter().find(|(id, _)| is_named(id)) {
            _ if !goals_canceling.is_empty() => CancelGoalResponseEnum::None,
            None if names_one => CancelGoalResponseEnum::UnknownGoal,
            Some((_, known)) if known.is_over() => CancelGoalResponseEnum::GoalTerminated,
            _ => CancelGoalResponseEnum::Rejected,
        };
        CancelGoalResponse {
            return_code,
            goals_canceling,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flag() -> Arc<AtomicBool> {
        Arc::new(AtomicBool::new(false))
    }

    fn at(goals: &mut Goals, id: GoalId, ns: i64) {
        goals.known.get_mut(&id).unwrap().accepted = Time::from_nanos(ns);
    }

    #[test]
    fn canceling_takes_the_goals_that_it_names() {
        let (mut goals, ids) = (Goals::default(), [(); 3].map(|()| GoalId::new_random()));
        let flags = ids.map(|id| {
            let flag = flag();
            assert!(goals.add(id, flag.clone()));
            flag
        });
        ids.iter()
            .zip([10, 20, 30])
            .for_each(|(id, ns)| at(&mut goals, *id, ns));
        let canceled = |flags: &[Arc<AtomicBool>; 3]| {
            flags.each_ref().map(|flag| flag.load(Ordering::Relaxed))
        };

        let response = goals.cancel((*ids[2].uuid.as_bytes(), 0));
        assert_eq!(
            (response.return_code, response.goals_canceling.len()),
            (CancelGoalResponseEnum::None, 1)
        );
        assert_eq!(canceled(&flags), [false, false, true]);
        goals.cancel(([0; 16], 10));
        assert_eq!(canceled(&flags), [true, false, true]);
        goals.cancel(([0; 16], 0));
        assert_eq!(canceled(&flags), [true, true, true]);
    }

    #[test]
    fn what_is_over_or_unknown_is_not_canceled() {
        let (mut goals, id) = (Goals::default(), GoalId::new_random());
        assert!(goals.add(id, flag()));
        goals.known.get_mut(&id).unwrap().result = Some(ProbeResponse::default());
        assert_eq!(
            goals.cancel((*id.uuid.as_bytes(), 0)).return_code,
            CancelGoalResponseEnum::GoalTerminated
        );
        assert_eq!(
            goals.cancel(([7; 16], 0)).return_code,
            CancelGoalResponseEnum::UnknownGoal
        );
        assert_eq!(
            goals.cancel(([0; 16], 0)).return_code,
            CancelGoalResponseEnum::Rejected
        );
    }

    #[test]
    fn goals_are_forgotten_only_when_they_are_over() {
        let mut goals = Goals::default();
        let ids: Vec<GoalId> = (0..MOST_GOALS).map(|_| GoalId::new_random()).collect();
        assert!(ids.iter().all(|id| goals.add(*id, flag())));
        assert!(!goals.add(ids[3], flag()), "the same again");
        assert!(!goals.add(GoalId::new_random(), flag()), "one too many");
        for number in [5, 4] {
            goals.known.get_mut(&ids[number]).unwrap().result = Some(ProbeResponse::default());
        }
        assert!(goals.add(GoalId::new_random(), flag()));
        assert!(!goals.known.contains_key(&ids[4]) && goals.known.contains_key(&ids[5]));
    }
}
