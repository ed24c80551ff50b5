// Notes on episodes: shown with an episode, and edited in a dialog if the server accepts notes.
"use strict";

Evalbus.Notes = class {
  // send({ run, episode, text }): sends a note to the server; returns false if there is no connection.
  constructor(send) {
    const e = Evalbus.element;
    this.send = send;
    this.byRun = new Map();
    this.canWrite = false;
    this.title = e("h3", {});
    this.input = e("textarea", { class: "ev-note-text", rows: "4", maxlength: "500", "aria-label": "note" });
    this.input.addEventListener("keydown", (event) => {
      if (event.key === "Enter" && !event.shiftKey) {
        event.preventDefault();
        this.save();
      }
    });
    this.error = e("p", { class: "ev-problem", role: "alert" });
    this.dialog = e("dialog", { class: "ev-keys ev-note-dialog", "aria-label": "note" }, this.title, this.input, this.error,
      e("p", { class: "ev-note" }, "Kept as notes.json in the run’s folder; an empty note is removed."),
      e("span", { class: "ev-segments" }, e("button", { type: "button", onclick: () => this.save() }, "Save"),
        e("button", { type: "button", onclick: () => this.dialog.close() }, "Cancel")));
  }

  hear(head) {
    this.canWrite = head.can_write;
    this.byRun.set(head.run, new Map(head.notes));
  }

  of(run, episode) {
    const notes = this.byRun.get(run);
    return (notes && notes.get(episode)) || "";
  }

  // title: text that names the episode.
  edit(run, episode, title) {
    this.edited = [run, episode];
    Evalbus.setText(this.title, `Note on ${title}`);
    this.input.value = this.of(run, episode);
    Evalbus.setText(this.error, "");
    this.dialog.showModal();
    this.input.focus();
  }

  save() {
    const [run, episode] = this.edited;
    const text = Evalbus.words(this.input.value);
    if (text === this.of(run, episode) || this.send({ run, episode, text })) this.dialog.close();
    else Evalbus.setText(this.error, Evalbus.NOT_SENT);
  }
};
