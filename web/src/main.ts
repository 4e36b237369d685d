/** Begin of the page: its style, then its line to the node and its parts, or the setup if there is no node yet. */
import "./theme.css";
import "./style.css";
import { Connection } from "./connection";
import { t } from "./language";
import { buildPage } from "./page";
import { replayedIn, socketAddress } from "./replay_place";
import { followTheme } from "./settings_menu";
import { buildSetupPage } from "./setup_page";
import { askSetup } from "./setup_state";

const replayed = replayedIn(location.search);
void begin();

async function begin(): Promise<void> {
  followTheme();
  const setup = await askSetup();
  if (setup !== null && setup !== "running") return buildSetupPage(setup);
  const connection = new Connection(socketAddress(location, replayed));
  try {
    buildPage(connection, replayed);
    connection.connect();
  } catch (error) {
    // most likely no WebGL: without it there is nothing to see
    console.error(error);
    document.body.textContent = t("noPicture");
    return;
  }
  connection.onState(({ kind }) => kind === "waiting" && void reloadForSetup());
}

/** A restarted program may have no node yet. */
async function reloadForSetup(): Promise<void> {
  const setup = await askSetup();
  if (setup !== null && setup !== "running") location.reload();
}
