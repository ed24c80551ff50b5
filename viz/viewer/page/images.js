// Images of a source's cameras, next to the 3D image. For each camera, the latest image at the current time is shown.
"use strict";

Evalbus.Images = class {
  constructor(place) {
    this.place = place;
    this.figures = [];
  }

  show(track, tick) {
    const cameras = (track && track.head.image_cameras) || [];
    this.place.hidden = cameras.length === 0;
    if (this.layout !== JSON.stringify(cameras)) {
      this.layout = JSON.stringify(cameras);
      this.figures.forEach((figure) => this.forget(figure));
      this.figures = cameras.map((camera) => {
        const image = Evalbus.element("img", { alt: Evalbus.words(camera) });
        return { image, shown: null, element: Evalbus.element("figure", {}, image, Evalbus.element("figcaption", {}, Evalbus.words(camera))) };
      });
      this.place.replaceChildren(...this.figures.map((figure) => figure.element));
    }
    this.figures.forEach((figure, camera) => {
      const bytes = track.imageAt(camera, tick);
      if (bytes === figure.shown) return;
      this.forget(figure);
      figure.shown = bytes;
      figure.element.classList.toggle("ev-no-image", bytes === null);
      if (bytes) figure.image.src = URL.createObjectURL(new Blob([bytes], { type: "image/jpeg" }));
    });
  }

  forget(figure) {
    if (figure.image.src) URL.revokeObjectURL(figure.image.src);
    figure.image.removeAttribute("src");
    figure.shown = null;
  }
};
