//! The node's services for pages: called by name, with a request in JSON.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};

use serde_json::{Map, Value};

use super::admission::access::Role;
use crate::ros::RosError;
use crate::ros::inbox::Inbox;
use crate::ros::locked;
use crate::ros::messages::RosService;
use crate::ros::port::Reply;
use crate::ros::services::{Serves, serve};

/// Reply to a request, now or later; `Err`: the reason of a failure, in words.
pub(super) type CallReply = Reply<Result<Value, String>>;
type PageService = Mutex<Box<dyn FnMut(Value, CallReply) + Send>>;

/// Reason of a refused call.
pub(super) const MAY_ONLY_LOOK: &str =
    "this page may look and not operate: open it by a link for operators";
/// Services for every page.
const ONLY_LOOKS: &[&str] = &["~/arm_state"];
/// Services that move an arm, except as a dry run; they need the page's hold-to-run button.
const MOVES: &[&str] = &["~/probe_feature", "~/probe_all"];

/// The services by name.
pub(super) struct Calls {
    services: BTreeMap<&'static str, PageService>,
    inbox: Inbox,
}

impl Calls {
    /// All services of the node.
    ///
    /// # Errors
    /// None here; other back ends may refuse a name.
    pub fn new(inbox: &Inbox) -> Result<Self, RosError> {
        let mut calls = Self {
            services: BTreeMap::new(),
            inbox: inbox.clone(),
        };
        serve(&mut calls, &Arc::new(inbox.clone()))?;
        Ok(calls)
    }

    /// Calls a service; errors come as a reply too.
    ///
    /// - `request`: its fields; missing ones are zero, empty or false.
    pub fn call(&self, role: Role, name: &str, request: Value, reply: CallReply) {
        let Some((known, service)) = self.services.get_key_value(name) else {
            return reply.send(Err(format!("there is no service \"{name}\"")));
        };
        if role != Role::Operate && !ONLY_LOOKS.contains(known) {
            return reply.send(Err(MAY_ONLY_LOOK.to_owned()));
        }
        let reply = match MOVES.contains(known) && request["settings"]["dry_run"] != true {
            false => reply,
            true => match self.inbox.stops().hold_to_run() {
                Ok(()) => self.held_until_answered(reply),
                Err(why) => return reply.send(Err(why)),
            },
        };
        (locked(service))(request, reply);
    }

    fn held_until_answered(&self, reply: CallReply) -> CallReply {
        let inbox = self.inbox.clone();
        Reply::new(move |answer| {
            inbox.stops().end_hold();
            reply.send(answer);
        })
    }
}

impl<S> Serves<S> for Calls
where
    S: RosService<Request: Default>,
{
    fn serve(
        &mut self,
        name: &'static str,
        mut call: impl FnMut(S::Request, Reply<S::Response>) + Send + 'static,
    ) -> Result<(), RosError> {
        let service = move |request: Value, reply: CallReply| match filled::<S::Request>(request) {
            Ok(request) => call(
                request,
                Reply::new(move |answer: S::Response| {
                    reply.send(serde_json::to_value(&answer).map_err(|error| error.to_string()));
                }),
            ),
            Err(why) => reply.send(Err(format!("{name}: {why}"))),
        };
        self.services.insert(name, Mutex::new(Box::new(service)));
        Ok(())
    }
}

/// A request with defaults for missing fields.
fn filled<Q>(given: Value) -> Result<Q, String>
where
    Q: Default + serde::Serialize + serde::de::DeserializeOwned,
{
    let mut whole = serde_json::to_value(Q::default()).map_err(|error| error.to_string())?;
    merge(&mut whole, given)?;
    serde_json::from_value(whole).map_err(|error| error.to_string())
}

fn merge(whole: &mut Value, given: Value) -> Result<(), String> {
    match (whole, given) {
        (_, Value::Null) => Ok(()),
        (Value::Object(whole), Value::Object(given)) => merge_fields(whole, given),
        (whole, given) => {
            *whole = given;
            Ok(())
        }
    }
}

fn merge_fields(whole: &mut Map<String, Value>, given: Map<String, Value>) -> Result<(), String> {
    for (name, value) in given {
        let Some(field) = whole.get_mut(&name) else {
            let known: Vec<_> = whole.keys().map(String::as_str).collect();
            return Err(format!(
                "there is no field \"{name}\"; there are: {}",
                known.join(", ")
            ));
        };
        merge(field, value)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::{Receiver, channel};

    use serde_json::json;

    use super::*;
    use crate::ros::inbox::{Arrivals, inbox};
    use crate::ros::messages::{ProbeFeatureRequest, ProbeFeatureResponse, UndoResponse};
    use crate::ros::port::{ArmOrder, Arrival, Call};
    use crate::ros::stop::LONGEST_BEAT;
    use touchup_probing::arm::StopRequest;
    use touchup_session::clock::{Clock, ManualClock};

    fn calls() -> (Calls, Arrivals, ManualClock) {
        let (clock, hand) = Clock::manual();
        let (inbox, arrivals) = inbox(8, &clock);
        (Calls::new(&inbox).unwrap(), arrivals, hand)
    }

    fn ask(
        calls: &Calls,
        role: Role,
        name: &str,
        request: Value,
    ) -> Receiver<Result<Value, String>> {
        let (to, answer) = channel();
        calls.call(
            role,
            name,
            request,
            Reply::new(move |said| drop(to.send(said))),
        );
        answer
    }

    #[test]
    fn a_service_is_called_with_the_fields_that_are_given() {
        let (calls, arrivals, _hand) = calls();
        let answer = ask(&calls, Role::Operate, "~/undo", json!({ "strokes": 3 }));
        let Some(Arrival::Call(Call::Undo(request, reply))) = arrivals.recv() else {
            panic!("no call")
        };
        assert_eq!(request.strokes, 3);
        reply.send(UndoResponse {
            success: true,
            strokes: 2,
            ..UndoResponse::default()
        });
        let said = answer.recv().unwrap().unwrap();
        assert_eq!(
            (&said["success"], &said["strokes"]),
            (&json!(true), &json!(2))
        );
    }

    #[test]
    fn what_is_wrong_with_a_request_is_said_and_nothing_is_called() {
        let (calls, arrivals, _hand) = calls();
        for (name, request, words) in [
            (
                "~/undo",
                json!({ "stroke": 3 }),
                "there is no field \"stroke\"; there are: strokes",
            ),
            ("~/undo", json!({ "strokes": -1 }), "~/undo: invalid value"),
            ("~/undo", json!("all"), "~/undo: invalid type"),
            (
                "~/format_disk",
                json!({}),
                "there is no service \"~/format_disk\"",
            ),
        ] {
            let said = ask(&calls, Role::Operate, name, request)
                .recv()
                .unwrap()
                .unwrap_err();
            assert!(said.contains(words), "{said}");
        }
        assert!(arrivals.try_recv().is_err());
    }

    #[test]
    fn who_only_looks_changes_nothing() {
        let (calls, arrivals, _hand) = calls();
        for name in calls
            .services
            .keys()
            .filter(|name| !ONLY_LOOKS.contains(name))
        {
            let said = ask(&calls, Role::Look, name, json!({}))
                .recv()
                .unwrap()
                .unwrap_err();
            assert!(said.contains("may look and not operate"), "{name}: {said}");
        }
        assert!(arrivals.try_recv().is_err());
        drop(ask(&calls, Role::Look, "~/arm_state", json!({})));
        assert!(arrivals.try_recv().is_ok());
    }

    #[test]
    fn an_order_to_the_arm_is_taken_while_the_button_is_held_and_ends_with_its_answer() {
        let (calls, arrivals, hand) = calls();
        let stops = arrivals.stops();
        let order = || ask(&calls, Role::Operate, "~/probe_feature", json!({ "id": 7 }));
        assert!(
            order()
                .recv()
                .unwrap()
                .unwrap_err()
                .contains("while the button is held")
        );
        let planned = ask(
            &calls,
            Role::Operate,
            "~/probe_feature",
            json!({ "id": 7, "settings": { "dry_run": true } }),
        );
        assert!(
            matches!(arrivals.recv(), Some(Arrival::Call(Call::Arm(_)))),
            "a plan needs no hand"
        );
        drop(planned);
        stops.beat();
        let answer = order();
        let Some(Arrival::Call(Call::Arm(ArmOrder::Feature(_, reply)))) = arrivals.recv() else {
            panic!("no order")
        };
        hand.advance(LONGEST_BEAT * 2);
        assert_eq!(stops.request(), Some(StopRequest::Stay));
        stops.ask_recovery();
        stops.recover().unwrap();
        reply.send(ProbeFeatureResponse::default());
        assert!(answer.recv().unwrap().is_ok());
        hand.advance(LONGEST_BEAT * 2);
        assert_eq!(stops.request(), None);
    }

    #[test]
    fn fields_of_fields_can_be_left_out() {
        let request: ProbeFeatureRequest =
            filled(json!({ "id": 7, "settings": { "dry_run": true } })).unwrap();
        assert!(request.id == 7 && request.settings.dry_run && request.settings.max_touches == 0);
    }
}
