// Creates those elements of the page that do not depend on runs or episodes.
"use strict";

Evalbus.ICONS = {
  play: "M4 2.5v11l9.5-5.5z", pause: "M4 2.5h3v11H4zM9.5 2.5h3v11h-3z", back: "M10.5 3L5.5 8l5 5", forth: "M5.5 3l5 5-5 5",
  first: "M12 3L7 8l5 5M4.2 3v10", last: "M4 3l5 5-5 5M11.8 3v10",
};

Evalbus.KEYS = [
  ["space", "play, pause"], ["← →", "step back, forward; with shift ten ticks"], ["[ ]", "previous, next event"],
  ["Home End", "first, last tick"], ["< >", "slower, faster"], ["+ −", "zoom the timeline (or mouse wheel)"],
  ["0", "show the whole episode"], ["l", "follow live"], ["p n", "previous, next episode"], ["j k", "next, previous failure"],
  ["1 … 9", "same seed of another policy; in the overview and the list, its episodes"], ["/", "filter the episodes"], ["b", "overview"], ["m", "note on the episode"],
  ["s", "save an image"], ["c", "next camera"], ["v", "ghost or side by side, when two episodes are compared"],
  ["x", "close comparison"],
  ["shift Enter", "pin the focused metric under the timeline"], ["?", "keyboard shortcuts"],
];

// Keys that have no effect in a report.
Evalbus.SERVER_KEYS = ["l", "j k", "1 … 9", "/", "b", "m", "s"];

Evalbus.makeLayout = (place) => {
  const isReport = place.dataset.from === "page";
  const e = Evalbus.element, icon = Evalbus.icon;
  const button = (name, title, isFilled) => e("button", { type: "button", class: "ev-icon", title, "aria-label": title },
    icon(Evalbus.ICONS[name], isFilled));
  const parts = {};
  // In a report, the title is an h2, because the report has its own h1.
  parts.title = e(isReport ? "h2" : "h1", { class: "ev-title" });
  parts.subtitle = e("p", { class: "ev-subtitle" });
  parts.state = e("span", { class: "ev-state-pill", role: "status" });
  parts.rate = e("span", { class: "ev-head-rate" });
  parts.help = e("button", { type: "button", class: "ev-icon ev-help", title: "keyboard shortcuts (?)", "aria-label": "keyboard shortcuts" }, "?");
  const head = e("header", { class: "ev-head" }, e("div", { class: "ev-titles" }, parts.title, parts.subtitle), parts.rate,
    parts.state, parts.help);

  parts.labels = e("div", { class: "ev-labels" });
  parts.camera = e("select", { class: "ev-camera", "aria-label": "camera", title: "camera" });
  parts.layers = e("details", { class: "ev-layers" }, e("summary", { title: "layers" }, "Show"));
  parts.layerList = e("div", { class: "ev-layer-list" });
  parts.layers.append(parts.layerList);
  parts.note = e("p", { class: "ev-scene-note", hidden: "" });
  parts.images = e("div", { class: "ev-images", hidden: "", "aria-label": "images of the source's cameras" });
  parts.view = e("div", { class: "ev-view" }, parts.labels, e("div", { class: "ev-tools" }, parts.camera, parts.layers),
    parts.note, parts.images);

  parts.first = button("first", "first tick (Home)");
  parts.before = button("back", "step back (←)");
  parts.play = e("button", { type: "button", class: "ev-icon ev-play", title: "play (space)", "aria-label": "play" },
    icon(Evalbus.ICONS.play, true));
  parts.after = button("forth", "step forward (→)");
  parts.end = button("last", "last tick (End)");
  parts.clockTime = e("b", {});
  parts.clockTick = e("span", {});
  parts.clock = e("span", { class: "ev-clock" }, parts.clockTime, parts.clockTick);
  parts.rateChoice = e("select", { class: "ev-speed", "aria-label": "speed", title: "speed (< >)" },
    Evalbus.Player.RATES.map((rate) => e("option", { value: String(rate) }, `${rate} ×`)));
  parts.follow = e("button", { type: "button", class: "ev-follow", title: "follow the live episode (l)" }, "Live");
  parts.mode = e("button", { type: "button", class: "ev-mode", hidden: "", title: "ghost or side by side (v)" });
  parts.uncompare = e("button", { type: "button", class: "ev-mode", hidden: "", title: "close comparison (x)" }, "Close comparison");
  parts.sameSeed = e("button", { type: "button", class: "ev-mode", hidden: "" });
  const transport = e("div", { class: "ev-transport" }, e("span", { class: "ev-buttons" }, parts.first, parts.before,
    parts.play, parts.after, parts.end), parts.clock, e("span", { class: "ev-gap" }), parts.sameSeed, parts.mode,
  parts.uncompare, parts.rateChoice, parts.follow);
  parts.lanes = e("div", { class: "ev-lanes-place" });

  parts.episodeTab = e("button", { type: "button", role: "tab" }, "Episode");
  parts.runTab = e("button", { type: "button", role: "tab" }, "Run");
  const tabs = e("div", { class: "ev-tabs", role: "tablist" }, parts.episodeTab, parts.runTab);
  parts.conditions = e("div", { class: "ev-conditions" });
  parts.curves = e("div", { class: "ev-metrics" }, e("h2", {}, "Metrics"));
  parts.empty = e("p", { class: "ev-empty" });
  parts.episodeBody = e("div", { class: "ev-episode-body" }, parts.conditions, parts.curves);
  parts.episode = e("section", { class: "ev-episode", "aria-label": "episode" }, parts.empty, parts.episodeBody);
  parts.run = e("section", { class: "ev-run", "aria-label": "run" });

  const keys = Evalbus.KEYS.filter(([key]) => !isReport || !Evalbus.SERVER_KEYS.includes(key));
  parts.keys = e("dialog", { class: "ev-keys" }, e("h2", {}, "Keyboard shortcuts"), e("dl", {}, keys.flatMap(([key, what]) =>
    [e("dt", {}, key.split(" ").flatMap((one, k) => (k ? [" ", e("kbd", {}, one)] : [e("kbd", {}, one)]))), e("dd", {}, what)])),
  e("button", { type: "button", onclick: () => parts.keys.close() }, "Close"));

  parts.app = e("div", { class: "ev-app", "data-tab": "episode" }, head, parts.view,
    e("div", { class: "ev-time" }, transport, parts.lanes), tabs, parts.episode, parts.run, parts.keys);
  const choose = (name) => {
    parts.app.dataset.tab = name;
    parts.episodeTab.setAttribute("aria-selected", String(name === "episode"));
    parts.runTab.setAttribute("aria-selected", String(name === "run"));
  };
  parts.episodeTab.addEventListener("click", () => choose("episode"));
  parts.runTab.addEventListener("click", () => choose("run"));
  choose("episode");
  place.replaceChildren(parts.app);
  return parts;
};
