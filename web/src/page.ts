/** Puts the page together: its displays and their listeners. */
import { ArmPanel } from "./arm_panel";
import type { Connection } from "./connection";
import { Controls } from "./controls";
import { button, el, write } from "./dom";
import { FeatureDetails } from "./feature_details";
import { isMinor, mainWords, nearestTo, title } from "./feature_facts";
import { FeatureList } from "./feature_list";
import { FlagMenu } from "./flag_menu";
import { Guidance } from "./guidance";
import { onLanguage, rewrite, t } from "./language";
import { Legend } from "./legend";
import { feedMesh } from "./mesh_feed";
import { MeshStore } from "./mesh_store";
import type { NotedFeature } from "./messages";
import { triple } from "./messages";
import { Model } from "./model";
import { Notices } from "./notices";
import { decimal, percent } from "./numbers";
import { Operating } from "./operating";
import { Picture } from "./picture";
import { Replay } from "./replay";
import { Sessions } from "./sessions";
import { settings } from "./settings";
import { Setup } from "./setup";
import { Share } from "./share";
import { StatusBar } from "./status_bar";
import { TakeOut } from "./take_out";
import { installTestHook } from "./test_hook";
import { isTouched } from "./touch_choice";
import { ForceBar, ViewBar } from "./view_bar";
import { Vector3 } from "three";

/** Time between frames while somebody holds the arm's button, ms. */
const CALM = 200;
/** Largest distance from a feature at which an operator with the tip asks for it, m. */
const NEAR = 0.05;

/** @param replayed name of the replayed session; null: the page shows the running one. */
export function buildPage(connection: Connection, replayed: string | null): void {
  const store = new MeshStore();
  const model = new Model(connection, replayed);
  const notices = new Notices();
  const operating = new Operating(connection, model, notices);
  const takeOut = new TakeOut(model, operating, (contacts) => picture.showTouch(contacts));
  const flagMenu = new FlagMenu(model, operating, takeOut);
  const picture = new Picture(store, {
    onSelect: (id) => model.select(model.selected === id ? null : id),
    onTap: (hit, x, y) => {
      flagMenu.close();
      // a place of a replay has no menu
      if (hit === null || replayed !== null) return model.select(null);
      picture.showMark(hit.point);
      flagMenu.open(hit.point, isTouched(store, hit.face), x, y);
    },
  });
  flagMenu.onClose = () => picture.showMark(null);
  const lookAt = (feature: NotedFeature): void => {
    const center = triple(feature.center);
    model.select(feature.id);
    if (center !== null) picture.camera.lookAt(new Vector3(...center));
  };
  const shownFeatures = (): NotedFeature[] => model.features.filter((feature) => settings.showsAll || !isMinor(feature) || feature.id === model.selected);
  const showFeatures = (): void => picture.showFeatures(shownFeatures(), model.selected);

  const list = new FeatureList(model, operating, (id) => model.select(id), showFeatures);
  const details = new FeatureDetails(model, operating);
  const guidance = new Guidance(model, () => list.show(), lookAt);
  const arm = new ArmPanel(model, operating, (isHeld) => (picture.stage.leastInterval = isHeld ? CALM : 0));
  const sessions = new Sessions(model, operating, notices);
  const legend = new Legend(store, picture.mesh, picture.stage);
  const force = new ForceBar();
  const loading = el("p", { class: "loading", attributes: { role: "status" } });
  const setup = new Setup(model, store, picture.tip.state);
  const share = new Share(operating);
  const status = new StatusBar(model, () => picture.theme(), () => setup.open(), () => share.show());
  const controls = new Controls(model, operating, () => void sessions.show(), () => void sessions.showReport());
  layOut();

  model.on(["features", "selected"], showFeatures);
  model.on(["selected"], () => (list.element.hidden = model.feature(model.selected) !== undefined));
  model.on(["features"], () => (list.element.hidden = model.feature(model.selected) !== undefined));
  onLanguage(showFeatures);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => picture.theme());
  listenToTip();
  listenToMesh();
  installTestHook(store, picture);
  rewrite(document.body);
  write(loading, t("loadingPart", { share: percent(0) }));

  function layOut(): void {
    const sheet = button("sheet", "sheet", () => document.body.classList.toggle("sheet-open"), "ghost sheet-handle", true);
    picture.element.append(loading, new ViewBar(picture.camera).element, force.element, legend.element, flagMenu.element, notices.element);
    const scroll = el("div", { class: "scroll" }, whyNot(), setup.element, guidance.element, details.element, list.element);
    const panel = el("aside", { class: "panel", label: "panel" }, sheet, scroll, arm.element);
    panel.removeAttribute("title");
    const main = el("main", { class: "main" }, picture.element, controls.element);
    document.body.append(status.element, status.remedy, el("div", { class: "work" }, main, panel), sessions.element, sessions.report.element, share.element);
    if (replayed !== null) layOutReplay(replayed);
  }

  /** Replaces the controls of a running session by those of the replay. */
  function layOutReplay(session: string): void {
    const onReading = (): void => write(loading, t("replayReading"));
    const replay = new Replay(connection, session, notices, onReading, () => (loading.hidden = true));
    document.body.classList.add("replaying");
    for (const each of [setup.element, guidance.element, arm.element, flagMenu.element, share.element]) each.remove();
    status.element.after(replay.banner);
    controls.element.replaceWith(replay.controls);
  }

  /** Says why the buttons rest. */
  function whyNot(): HTMLElement {
    const note = el("p", { class: "card note", attributes: { role: "status" } });
    const show = (): void => {
      // the banner of a replay says why already
      const reason = model.state === null || (replayed !== null && model.isConnected) ? null : operating.reason();
      note.hidden = reason === null;
      write(note, reason ?? "");
    };
    model.on(["state", "line"], show);
    onLanguage(show);
    show();
    return note;
  }

  function listenToTip(): void {
    connection.on("tip", ({ markers }) => {
      picture.tip.markers(markers);
      const { place, next } = picture.tip.state;
      guidance.arrow(next);
      picture.labels.showTip(place, ...tipWords());
      if (place !== null) picture.camera.tipAt(place);
      picture.stage.ask();
    });
    connection.on("mismatch", (message) => {
      picture.tip.mismatch(message);
      force.show(picture.tip.state.force);
      setup.read();
      picture.stage.ask();
    });
    connection.on("path", ({ poses }) => picture.showPath(poses.map(({ pose }) => pose.position)));
  }

  /** "0.12 mm", and "Hole 3 Ø 8.02 ± 0.04 mm" of the feature that is nearest. */
  function tipWords(): [string, string] {
    const { place, distance } = picture.tip.state;
    const far = distance === null ? t("tipFar") : `${decimal(distance * 1e3, 2)}\u00a0mm`;
    const nearest = place === null ? null : nearestTo(place, model.features, NEAR);
    return [far, nearest === null ? "" : `${title(nearest)} ${mainWords(nearest)}`];
  }

  function listenToMesh(): void {
    feedMesh(connection, store, {
      // a replay that begins again keeps its view
      onOther: () => replayed === null && picture.camera.forget(),
      onGap: () => notices.bad(t("failedMesh")),
      onChange: () => {
        loading.hidden = store.version > 0;
        write(loading, t("loadingPart", { share: percent(store.progress) }));
        if (!store.isWhole) return;
        picture.camera.frameOnce();
        setup.meshCame();
        legend.meshChanged();
        picture.stage.ask();
      },
    });
  }
}
