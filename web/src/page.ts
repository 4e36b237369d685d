/** Puts the page together: who shows what, and who is told of what. */
import { ArmPanel } from "./arm_panel";
import type { Connection } from "./connection";
import { Controls } from "./controls";
import { button, el, write } from "./dom";
import { FeatureDetails } from "./feature_details";
import { isMinor, mainWords, title } from "./feature_facts";
import { FeatureList } from "./feature_list";
import { FlagMenu } from "./flag_menu";
import { Guidance } from "./guidance";
import { onLanguage, rewrite, t } from "./language";
import { Legend } from "./legend";
import { feedMesh } from "./mesh_feed";
import { MeshStore } from "./mesh_store";
import type { Feature } from "./messages";
import { triple } from "./messages";
import { Model } from "./model";
import { Notices } from "./notices";
import { decimal } from "./numbers";
import { Operating } from "./operating";
import { Picture } from "./picture";
import { Sessions } from "./sessions";
import { settings } from "./settings";
import { StatusBar } from "./status_bar";
import { installTestHook } from "./test_hook";
import { ForceBar, ViewBar } from "./view_bar";
import { Vector3 } from "three";

/** Farther from a feature than this nobody who holds the tip asks for it, m. */
const NEAR = 0.05;

export function buildPage(connection: Connection): void {
  const store = new MeshStore();
  const model = new Model(connection);
  const notices = new Notices();
  const operating = new Operating(connection, model, notices);
  const flagMenu = new FlagMenu(operating);
  const picture = new Picture(store, {
    onSelect: (id) => model.select(model.selected === id ? null : id),
    onTap: (hit, x, y) => {
      flagMenu.close();
      if (hit === null) return model.select(null);
      picture.showMark(hit.point);
      flagMenu.open(hit.point, x, y);
    },
  });
  flagMenu.onClose = () => picture.showMark(null);
  const lookAt = (feature: Feature): void => {
    const center = triple(feature.center);
    model.select(feature.id);
    if (center !== null) picture.camera.lookAt(new Vector3(...center));
  };
  const shownFeatures = (): Feature[] => model.features.filter((feature) => settings.showsAll || !isMinor(feature) || feature.id === model.selected);
  const showFeatures = (): void => picture.showFeatures(shownFeatures(), model.selected);

  const list = new FeatureList(model, operating, (id) => model.select(id), showFeatures);
  const details = new FeatureDetails(model, operating);
  const guidance = new Guidance(model, () => list.show(), lookAt);
  const arm = new ArmPanel(model, operating);
  const sessions = new Sessions(notices);
  const legend = new Legend(store, picture.mesh, picture.stage);
  const force = new ForceBar();
  const status = new StatusBar(model, () => picture.theme());
  const controls = new Controls(model, operating, () => void sessions.show());
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

  function layOut(): void {
    const sheet = button("sheet", "sheet", () => document.body.classList.toggle("sheet-open"), "ghost sheet-handle", true);
    picture.element.append(new ViewBar(picture.camera).element, force.element, legend.element, flagMenu.element, notices.element);
    const scroll = el("div", { class: "scroll" }, whyNot(), guidance.element, details.element, list.element);
    const panel = el("aside", { class: "panel", label: "panel" }, sheet, scroll, arm.element);
    panel.removeAttribute("title");
    const main = el("main", { class: "main" }, picture.element, controls.element);
    document.body.append(status.element, status.remedy, el("div", { class: "work" }, main, panel), sessions.element);
  }

  /** Says why the buttons rest. */
  function whyNot(): HTMLElement {
    const note = el("p", { class: "card note", attributes: { role: "status" } });
    const show = (): void => {
      const reason = model.state === null ? null : operating.reason();
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
      guidance.arrow(next !== null);
      picture.labels.showTip(place, tipWords());
      if (place !== null) picture.camera.tipAt(place);
      picture.stage.ask();
    });
    connection.on("mismatch", (message) => {
      picture.tip.mismatch(message);
      force.show(picture.tip.state.force);
      picture.stage.ask();
    });
    connection.on("path", ({ poses }) => picture.showPath(poses.map(({ pose }) => pose.position)));
  }

  /** "0.12 mm · Hole 3 Ø 8.02 ± 0.04 mm" */
  function tipWords(): string {
    const { place, distance } = picture.tip.state;
    const far = distance === null ? t("tipFar") : `${decimal(distance * 1e3, 2)}\u00a0mm`;
    let nearest: Feature | null = null;
    let least = NEAR;
    for (const feature of model.features) {
      const center = triple(feature.center);
      if (place === null || center === null || isMinor(feature)) continue;
      const distance = place.distanceTo(new Vector3(...center));
      if (distance < least) [nearest, least] = [feature, distance];
    }
    return nearest === null ? far : `${far} · ${title(nearest)} ${mainWords(nearest)}`;
  }

  function listenToMesh(): void {
    feedMesh(connection, store, {
      onOther: () => picture.camera.forget(),
      onGap: () => notices.bad(t("failedMesh")),
      onChange: () => {
        if (store.version === 0) {
          // the first parts of the first whole state: the part grows in the picture
          picture.camera.show("whole");
          if (store.faceCount === 0) return;
        }
        picture.camera.frameOnce();
        legend.meshChanged();
        picture.stage.ask();
      },
    });
  }
}
