//! The action `~/probe`: goals, their feedback, and cancel requests.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

use futures::{FutureExt, Stream, StreamExt};
use r2r::{ActionServerCancelRequest, ActionServerGoal, ActionServerGoalRequest, Node};

use super::back_end::{PollSource, RclErrorContext, source};
use super::convert::Convert;
use super::touchup_msgs::action::Probe::Action;
use crate::ros::exchange::{PortState, RosError};
use crate::ros::locked;
use crate::ros::messages::{ProbeFeedback, ProbeGoal, ProbeResponse};
use crate::ros::port::{ArmOrder, Call, Feedback, Goal, GoalEnd};
use crate::ros::services::PROBE;

/// State of a goal from its request to the result.
enum GoalState {
    Asked(ActionServerGoalRequest<Action>),
    Running(ActionServerGoal<Action>),
    Over,
}

/// State shared by the closures of one goal.
struct GoalHandle {
    state: Mutex<GoalState>,
    is_cancelled: Arc<AtomicBool>,
    is_over: AtomicBool,
}

impl GoalHandle {
    /// Sets the state; returns the previous one.
    fn change(&self, state: GoalState) -> GoalState {
        std::mem::replace(&mut *locked(&self.state), state)
    }
}

/// A running goal, and its cancel requests.
struct Cancels {
    handle: Arc<GoalHandle>,
    requests: Box<dyn Stream<Item = ActionServerCancelRequest> + Send + Unpin>,
}

type RunningGoals = Arc<Mutex<Vec<Cancels>>>;

/// The server of the action: one source of goals, one of cancel requests.
pub(super) fn server(
    node: &mut Node,
    exchange: &Arc<PortState>,
) -> Result<[PollSource; 2], RosError> {
    let requests = node
        .create_action_server::<Action>(PROBE)
        .during("offering an action")?;
    let running = RunningGoals::default();
    let cancels = running.clone();
    let exchange = exchange.clone();
    let goals = source(requests, move |request: ActionServerGoalRequest<Action>| {
        let wanted = ProbeGoal::ours(request.goal.clone());
        exchange.inbox.call(Call::Arm(ArmOrder::Goal(
            wanted,
            goal(request, &exchange, &running),
        )));
    });
    Ok([goals, Box::new(move || take_cancels(&mut locked(&cancels)))])
}

/// Replies of the node, sent by the sending thread to keep their order.
fn goal(
    request: ActionServerGoalRequest<Action>,
    exchange: &Arc<PortState>,
    running: &RunningGoals,
) -> Goal {
    let is_cancelled = Arc::new(AtomicBool::new(false));
    let handle = Arc::new(GoalHandle {
        state: Mutex::new(GoalState::Asked(request)),
        is_cancelled: is_cancelled.clone(),
        is_over: AtomicBool::new(false),
    });
    let [for_accept, for_feedback, for_result] = [handle.clone(), handle.clone(), handle];
    let (running, sending) = (running.clone(), exchange.clone());
    Goal {
        accept: exchange.reply(PROBE, move |is_accepted| {
            accept(&for_accept, is_accepted, &running)
        }),
        feedback: Feedback(Box::new(move |feedback| {
            let handle = for_feedback.clone();
            sending
                .urgent
                .answer(Box::new(move || publish(&handle, feedback)));
        })),
        result: exchange.reply(PROBE, move |(end, response)| {
            finish(&for_result, end, response)
        }),
        is_cancelled,
    }
}

fn accept(handle: &Arc<GoalHandle>, is_accepted: bool, running: &RunningGoals) -> r2r::Result<()> {
    let GoalState::Asked(request) = handle.change(GoalState::Over) else {
        return Ok(());
    };
    if !is_accepted {
        return request.reject();
    }
    let (goal, requests) = request.accept()?;
    handle.change(GoalState::Running(goal));
    locked(running).push(Cancels {
        handle: handle.clone(),
        requests: Box::new(requests),
    });
    Ok(())
}

fn publish(handle: &GoalHandle, feedback: ProbeFeedback) {
    if let GoalState::Running(goal) = &*locked(&handle.state)
        && let Err(error) = goal.publish_feedback(feedback.theirs())
    {
        // nobody waits for a missed feedback
        tracing::debug!(%error, "feedback is not sent");
    }
}

fn finish(handle: &GoalHandle, end: GoalEnd, response: ProbeResponse) -> r2r::Result<()> {
    let GoalState::Running(mut goal) = handle.change(GoalState::Over) else {
        return Ok(());
    };
    handle.is_over.store(true, Ordering::Relaxed);
    let cancelled = response.clone().theirs();
    // r2r drops a goal after the confirmation of its cancel: from then on no other end reaches the
    // client
    match end {
        GoalEnd::Canceled => goal.cancel(cancelled),
        GoalEnd::Succeeded => goal
            .succeed(response.theirs())
            .or_else(|_| goal.cancel(cancelled)),
        GoalEnd::Aborted => goal
            .abort(response.theirs())
            .or_else(|_| goal.cancel(cancelled)),
    }
}

/// Confirms cancel requests and sets the flag for the node, which stops when it can; forgets
/// finished goals.
fn take_cancels(running: &mut Vec<Cancels>) -> bool {
    let mut has_come = false;
    for cancels in running.iter_mut() {
        while let Some(Some(request)) = cancels.requests.next().now_or_never() {
            cancels.handle.is_cancelled.store(true, Ordering::Relaxed);
            request.accept();
            has_come = true;
        }
    }
    running.retain(|cancels| !cancels.handle.is_over.load(Ordering::Relaxed));
    has_come
}
