//! One page that follows a replay.

use std::sync::Arc;
use std::time::Duration;

use axum::extract::ws::{Message, WebSocket};
use tokio::time::timeout;

use super::replays::{Replay, Replays};
use crate::page::admission::access::Role;
use crate::page::board::text_of;
use crate::page::connection;
use crate::page::page_place::PagePlace;
use crate::page::replay_state::ReplayShown;
use crate::page::site::Site;

/// Interval of progress messages while the session loads.
const SIGN_OF_LIFE: Duration = Duration::from_secs(2);
/// Time-out for a page that accepts nothing.
const GONE_AFTER: Duration = Duration::from_secs(20);

/// Serves a page of a replay until it disconnects; a refused page gets the reason.
pub(in crate::page) async fn serve(mut socket: WebSocket, replays: &Replays, session: &str) {
    let replay = match replays.join(session) {
        Ok(replay) => replay,
        Err(why) => return refuse(&mut socket, session, why).await,
    };
    let site = match opened(&mut socket, &replay).await {
        None => return,
        Some(Ok(site)) => site,
        Some(Err(why)) => return refuse(&mut socket, session, why).await,
    };
    match PagePlace::take(&site) {
        None => {
            refuse(
                &mut socket,
                session,
                "so many pages look at it already: close one".to_owned(),
            )
            .await
        }
        // a replay has no operator
        Some(place) => {
            connection::serve(socket, site, Role::Look).await;
            drop(place);
        }
    }
    // the last page ends the replay
    drop(replay);
}

/// Content of the replay, once loaded; `None`: the page has disconnected.
async fn opened(socket: &mut WebSocket, replay: &Replay) -> Option<Result<Arc<Site>, String>> {
    let mut opened = replay.opened.clone();
    loop {
        if let Some(found) = opened.borrow_and_update().clone() {
            return Some(found);
        }
        say(socket, &replay.control.shown()).await?;
        if let Ok(Err(_)) = timeout(SIGN_OF_LIFE, opened.changed()).await {
            return Some(Err(
                "there is no thread for it: end other programs".to_owned()
            ));
        }
    }
}

async fn refuse(socket: &mut WebSocket, session: &str, why: String) {
    if say(socket, &ReplayShown::refused(session, why))
        .await
        .is_some()
    {
        // the page may have disconnected meanwhile
        let _ = timeout(GONE_AFTER, socket.send(Message::Close(None))).await;
    }
}

/// Whether the page has received the message.
async fn say(socket: &mut WebSocket, shown: &ReplayShown) -> Option<()> {
    let text = text_of("replay", shown)?;
    timeout(GONE_AFTER, socket.send(Message::text(text)))
        .await
        .ok()?
        .ok()
}
