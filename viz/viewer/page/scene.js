// The 3D image: a canvas that shows one or two episodes, and the cameras of the canvas. It is redrawn only if something has
// changed: `isDirty` is then set, which calls onDirty().
"use strict";

Evalbus.SceneView = class {
  // Throws Error if the browser does not support WebGL.
  constructor(place, assets, palette) {
    this.place = place;
    this.assets = assets;
    this.palette = palette;
    this.onDirty = () => {};
    this.canvas = Evalbus.element("canvas", { class: "ev-canvas", "aria-label": "the scene in 3D" });
    // The context is requested here, because three.js would log errors to the console if WebGL is missing.
    const options = { antialias: true, alpha: false, powerPreference: "high-performance", stencil: false };
    const context = this.canvas.getContext("webgl2", options) || this.canvas.getContext("webgl", options);
    if (!context) throw new Error("this browser has no WebGL");
    this.renderer = new THREE.WebGLRenderer({ canvas: this.canvas, context, antialias: true });
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = THREE.PCFShadowMap;
    this.renderer.autoClear = false;
    // The canvas is hidden until the first image, because an empty canvas is black.
    this.canvas.style.visibility = "hidden";
    place.prepend(this.canvas);
    this.label = Evalbus.element("div", { class: "ev-clearance", hidden: "" });
    place.append(this.label);

    this.camera = new THREE.PerspectiveCamera(40, 4 / 3, 0.01, 60);
    this.camera.up.set(0, 0, 1);
    this.controls = new THREE.OrbitControls(this.camera, this.canvas);
    this.controls.enableKeys = false;
    this.controls.enableDamping = !matchMedia("(prefers-reduced-motion: reduce)").matches;
    this.controls.dampingFactor = 0.15;
    this.controls.minDistance = 0.05;
    this.controls.maxDistance = 20;
    this.controls.screenSpacePanning = true;
    this.controls.addEventListener("change", () => { this.isDirty = true; });
    this.controls.addEventListener("start", () => this.setFree());
    this.shareTouch();
    this.cameraName = null;  // null: free camera
    this.fovy = 40;
    this.onCamera = () => {};
    this.onSlow = () => {};
    this.views = [];  // {world, marks, scene} of A and, if compared, of B
    this.isBeside = false;
    this.layers = { contacts: true, trails: true, collision: false, clearance: false, shadows: true, highlight: true };
    this.isDirty = true;
    this.outline = Evalbus.outlineMaterial();
    this.matrix = new THREE.Matrix4();
    this.scratch = new THREE.Vector3();
    this.watcher = new ResizeObserver(() => {
      this.resize();
      // Resizing makes the canvas black, so it is redrawn before the browser paints it.
      this.draw();
    });
    this.watcher.observe(place);
    this.canvas.addEventListener("webglcontextlost", (event) => {
      event.preventDefault();
      this.isLost = true;
    });
    this.canvas.addEventListener("webglcontextrestored", () => {
      this.isLost = false;
      this.isDirty = true;
    });
    this.slow = 0;
    this.ratio = Math.min(window.devicePixelRatio || 1, 2);
    this.resize();
  }

  get isDirty() { return this.hasChanged; }

  set isDirty(isDirty) {
    this.hasChanged = isDirty;
    if (isDirty) this.onDirty();
  }

  // In a page that scrolls, one finger that moves up or down on the image scrolls the page (with `touch-action: pan-y` of the
  // canvas). OrbitControls prevents this at the first touch, so it receives this touch only when the finger moves sideways.
  shareTouch() {
    let first = null;  // touch whose direction is not known yet
    let isScroll = false;
    const listen = (type, handle) => this.place.addEventListener(type, (event) => {
      if (event.target === this.canvas && event.isTrusted && handle(event)) event.stopPropagation();
    }, { capture: true, passive: true });
    listen("touchstart", ({ touches }) => {
      isScroll = false;
      first = touches.length === 1 && document.scrollingElement.scrollHeight > innerHeight + 1 ? touches[0] : null;
      return first !== null;
    });
    listen("touchmove", ({ touches, cancelable }) => {
      // While the page scrolls, the event cannot be canceled.
      if (!first || !cancelable) return isScroll || !cancelable;
      isScroll = Math.abs(touches[0].clientX - first.clientX) <= Math.abs(touches[0].clientY - first.clientY);
      const list = [first];
      first = null;
      if (!isScroll) {
        this.canvas.dispatchEvent(new TouchEvent("touchstart", { touches: list, targetTouches: list, changedTouches: list, cancelable: true }));
      }
      return isScroll;
    });
  }

  // Lets the wheel zoom only while the image has the keyboard focus, as after a click. Used on pages that scroll.
  zoomOnFocus() {
    this.controls.enableZoom = false;
    this.canvas.addEventListener("focus", () => { this.controls.enableZoom = true; });
    this.canvas.addEventListener("blur", () => { this.controls.enableZoom = false; });
  }

  // tracks: one episode, or two to compare. Resolves to true when they are shown, and to false if a later call has replaced
  // this call.
  async show(tracks, isBeside) {
    const turn = this.turn = (this.turn || 0) + 1;
    const scenes = await Promise.all(tracks.map((track) => this.assets.scene(track.head.scene)));
    if (turn !== this.turn || this.isGone) return false;
    this.clear();
    this.isBeside = isBeside && tracks.length > 1;
    tracks.forEach((track, k) => {
      const isGhost = k > 0 && !this.isBeside;
      const world = new Evalbus.World(scenes[k], track, isGhost ? this.palette.b : null);
      const marks = new Evalbus.Marks(world, this.palette);
      let scene = isGhost ? this.views[0].scene : null;
      if (!scene) {
        scene = new THREE.Scene();
        scene.sky = this.skyOf(world.head.sky);
        scene.add(scene.sky);
        const headlight = world.head.headlight;
        if (headlight) {
          // This light is at the camera. draw() updates its position.
          scene.headlight = new THREE.DirectionalLight(new THREE.Color(...headlight.diffuse), 1);
          scene.add(scene.headlight, scene.headlight.target);
        }
      }
      scene.add(world.root, marks.group);
      this.views.push({ world, marks, scene });
    });
    const head = scenes[0].head;
    if (this.sceneId !== tracks[0].head.scene) {
      const isFirst = this.sceneId === undefined;
      this.sceneId = tracks[0].head.scene;
      if (isFirst || (this.cameraName && !this.cameraOf(this.cameraName))) this.home();
    }
    this.cameras = head.cameras.map((camera) => camera.name);
    this.applyLayers();
    this.resize();
    return true;
  }

  // Replaces the data of a shown episode by more complete data of the same episode. Returns false if the appearance differs.
  // In this case, show() must be called.
  exchange(before, track) {
    const looks = (one) => JSON.stringify([one.head.scene, one.head.bodies, one.head.arms, one.head.appearance]);
    if (looks(before) !== looks(track)) return false;
    for (const { world, marks } of this.views) {
      if (world.track !== before) continue;
      world.track = track;
      marks.follow(track);
    }
    return true;
  }

  // Frees the episodes and shows no image until the next call of show().
  hide() {
    this.turn = (this.turn || 0) + 1;
    this.clear();
    this.canvas.style.visibility = "hidden";
  }

  clear() {
    for (const { world, marks } of this.views) {
      world.dispose();
      marks.dispose();
    }
    for (const scene of new Set(this.views.map((view) => view.scene))) {
      scene.sky.geometry.dispose();
      scene.sky.material.dispose();
      scene.dispose();
    }
    this.views = [];
  }

  skyOf(sky) {
    const color = (rgb, other) => new THREE.Color(...(rgb || other));
    const material = new THREE.ShaderMaterial({
      uniforms: {
        above: { value: color(sky && sky.above, [0.24, 0.29, 0.35]) },
        below: { value: color(sky && sky.below, [0.6, 0.63, 0.66]) },
      },
      vertexShader: "varying vec3 way; void main() { way = position; gl_Position = projectionMatrix * "
        + "vec4(mat3(modelViewMatrix) * position, 1.0); }",
      fragmentShader: "varying vec3 way; uniform vec3 above; uniform vec3 below; void main() { "
        + "gl_FragColor = vec4(mix(below, above, 0.5 + 0.5 * normalize(way).z), 1.0); }",
      side: THREE.BackSide, depthTest: false, depthWrite: false,
    });
    const mesh = new THREE.Mesh(new THREE.SphereBufferGeometry(10, 32, 24), material);
    mesh.frustumCulled = false;
    mesh.renderOrder = -10;
    return mesh;
  }

  cameraOf(name) {
    const view = this.views[0];
    return view && view.world.cameras.find((camera) => camera.name === name);
  }

  // Moves the free camera to the pose of the camera "overview" or, if the scene has none, of its first camera. In a scene
  // without cameras, it looks at the center from one corner.
  home() {
    const view = this.views[0];
    if (!view) return;
    const overview = view.world.cameras.find((camera) => camera.name === "overview") || view.world.cameras[0];
    const middle = view.world.head.center_m || [0, 0, 0], reach = view.world.head.extent_m || 1;
    if (overview) {
      this.useCamera(overview);
      this.setFree();
    } else {
      this.camera.position.set(middle[0] + 1.4 * reach, middle[1] - 1.2 * reach, middle[2] + reach);
      this.controls.target.set(...middle);
      this.fovy = 40;
      this.setFree();
      this.camera.lookAt(this.controls.target);
    }
    this.resize();
  }

  // Copies the camera of another view.
  lookLike(other) {
    this.cameraName = other.cameraName;
    this.isFreed = true;
    this.camera.position.copy(other.camera.position);
    this.camera.quaternion.copy(other.camera.quaternion);
    this.controls.target.copy(other.controls.target);
    this.fovy = other.fovy;
    this.resize();
  }

  setCamera(name) {
    if (name === null) {
      this.home();
      return;
    }
    if (!this.cameraOf(name)) return;
    this.cameraName = name;
    this.isDirty = true;
    this.onCamera(name);
    this.resize();
  }

  // Switches to the free camera at the current pose. It orbits around the point at the center of the image.
  setFree() {
    if (this.cameraName === null && this.isFreed) return;
    const way = this.camera.getWorldDirection(new THREE.Vector3());
    const view = this.views[0];
    const middle = new THREE.Vector3(...((view && view.world.head.center_m) || [0, 0, 0]));
    const distance = Math.max(0.3, middle.sub(this.camera.position).dot(way));
    this.controls.target.copy(this.camera.position).addScaledVector(way, distance);
    this.cameraName = null;
    this.isFreed = true;
    this.isDirty = true;
    this.onCamera(null);
  }

  useCamera(camera) {
    this.views[0].world.placeOf(camera.body, camera.position_m, camera.quat_wxyz, this.matrix);
    this.matrix.decompose(this.camera.position, this.camera.quaternion, this.scratch);
    if (this.fovy !== camera.fovy_deg) {
      this.fovy = camera.fovy_deg;
      this.resize();
    }
  }

  setLayer(name, isShown) {
    this.layers[name] = isShown;
    this.applyLayers();
  }

  applyLayers() {
    this.renderer.shadowMap.autoUpdate = this.layers.shadows;
    for (const { world, marks } of this.views) {
      world.showCollision(this.layers.collision);
      for (const light of world.root.children) {
        if (light.shadow) light.castShadow = this.layers.shadows && light.shadow.mapSize.x === 2048;
      }
      marks.shows = { ...this.layers };
    }
    this.isDirty = true;
  }

  resize() {
    const width = this.place.clientWidth, height = this.place.clientHeight;
    if (!width || !height || this.isGone) return;
    this.renderer.setPixelRatio(this.ratio);
    this.renderer.setSize(width, height, false);
    this.width = width;
    this.height = height;
    const aspect = (this.isBeside ? width / 2 : width) / height;
    // In a tall window, the horizontal field of view is at least as wide as in a 4:3 video.
    const half = Math.tan(this.fovy * Math.PI / 360) * Math.max(1, 4 / 3 / aspect);
    this.camera.fov = 360 / Math.PI * Math.atan(half);
    this.camera.aspect = aspect;
    this.outline.uniforms.pixel.value.set(2 / (aspect * height), 2 / height);
    this.camera.updateProjectionMatrix();
    this.isDirty = true;
  }

  // ticks: current ticks of A and of B. lit: for A and B, index of the object to highlight; -1 for none.
  update(ticks, lit) {
    this.views.forEach(({ world, marks }, k) => {
      world.update(ticks[k]);
      world.outline(this.layers.highlight ? lit[k] : -1, this.outline);
      marks.update(ticks[k]);
    });
    this.isDirty = true;
  }

  // Must be called for each animation frame. Draws if something has changed. Returns whether it has drawn.
  draw() {
    if (this.isGone || this.isLost || !this.views.length) return false;
    if (this.cameraName === null) {
      this.controls.update();
    } else {
      const camera = this.cameraOf(this.cameraName);
      if (camera) this.useCamera(camera);
    }
    if (!this.isDirty) return false;
    this.isDirty = false;
    this.camera.updateMatrixWorld();
    const scenes = this.isBeside ? this.views.map((view) => view.scene) : [this.views[0].scene];
    this.renderer.setScissorTest(true);
    scenes.forEach((scene, k) => {
      if (scene.headlight) {
        scene.headlight.position.copy(this.camera.position);
        this.camera.getWorldDirection(scene.headlight.target.position).add(this.camera.position);
      }
      const left = k * this.width / scenes.length, width = this.width / scenes.length;
      this.renderer.setViewport(left, 0, width, this.height);
      this.renderer.setScissor(left, 0, width, this.height);
      this.renderer.clear();
      this.renderer.render(scene, this.camera);
    });
    this.canvas.style.visibility = "";
    this.drawLabel();
    return true;
  }

  drawLabel() {
    const middle = this.views[0].marks.clearanceMiddle();
    this.label.hidden = !middle;
    if (!middle) return;
    const p = this.views[0].marks.clearance.geometry.attributes.position.array;
    const length = Math.hypot(p[0] - p[3], p[1] - p[4], p[2] - p[5]);
    Evalbus.setText(this.label, `${(1000 * length).toFixed(1)} mm`);
    middle.project(this.camera);
    const width = this.isBeside ? this.width / 2 : this.width;
    this.label.style.transform =
      `translate(${((middle.x + 1) / 2 * width + 8).toFixed(1)}px, ${((1 - middle.y) / 2 * this.height).toFixed(1)}px)`;
  }

  // Lowers the quality if frames take long, as on machines that render in software: the resolution is reduced in two steps,
  // then shadows are disabled. The quality is not raised again. took_ms: duration of the last drawn frame.
  adapt(took_ms) {
    this.slow = took_ms > 70 ? this.slow + Math.min(3, took_ms / 70) : Math.max(0, this.slow - 1);
    if (this.slow < 8) return;
    this.slow = 0;
    if (this.ratio > 1) this.ratio = 1;
    else if (this.ratio > 0.6) this.ratio = 0.6;
    else if (this.layers.shadows) this.onSlow();
    else return;
    this.resize();
  }

  dispose() {
    this.isGone = true;
    this.watcher.disconnect();
    this.clear();
    this.outline.dispose();
    this.controls.dispose();
    this.renderer.dispose();
    if (this.renderer.forceContextLoss) this.renderer.forceContextLoss();
    this.canvas.remove();
    this.label.remove();
  }
};
