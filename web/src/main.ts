/** Where the page begins: its style, its line to the node, its parts. */
import "./theme.css";
import "./style.css";
import { Connection } from "./connection";
import { t } from "./language";
import { buildPage } from "./page";

const address = `${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/ws`;
const connection = new Connection(address);
try {
  buildPage(connection);
  connection.connect();
} catch (error) {
  // most likely no WebGL: without it there is nothing to see
  console.error(error);
  document.body.textContent = t("noPicture");
}
