// The bodies of one episode as a scene graph. Static bodies are merged into a few meshes, and each moving body is a group.
"use strict";

// Cache of geometries and textures, which the episodes share.
Evalbus.Assets = class {
  constructor(source) {
    this.source = source;
    this.meshes = new Evalbus.Once(async (id) => {
      const block = await source.block(id);
      const geometry = Evalbus.shapes.mesh(block);
      geometry.isOwnUv = block.has("uv");
      return geometry;
    });
    this.textures = new Evalbus.Once(async (id) => {
      const png = (await source.block(id)).raw("png");
      const image = await createImageBitmap(new Blob([png], { type: "image/png" }));
      const texture = new THREE.Texture(image);
      texture.wrapS = texture.wrapT = THREE.RepeatWrapping;
      texture.flipY = false;
      texture.anisotropy = 4;
      texture.needsUpdate = true;
      return texture;
    });
  }

  // Returns {head, meshes, textures} of a scene when everything has been loaded.
  async scene(id) {
    const head = (await this.source.block(id)).head;
    const load = async (once, ids) => {
      const list = [...new Set(ids.filter((one) => one))];
      const made = await Promise.all(list.map((one) => once.get(one)));
      return new Map(list.map((one, k) => [one, made[k]]));
    };
    const [meshes, textures] = await Promise.all([
      load(this.meshes, head.geoms.map((geom) => geom.mesh)),
      load(this.textures, [...head.materials.map((material) => material.texture), ...(head.textures || [])])]);
    return { head, meshes, textures };
  }
};

Evalbus.World = class {
  // look: null, or the color in which moving bodies are drawn as translucent ghosts.
  constructor(scene, track, look) {
    this.head = scene.head;
    this.track = track;
    this.root = new THREE.Group();
    this.isGhost = Boolean(look);
    const appearance = track.head.appearance || {};
    const changed = (list, changes) => {
      const copy = list.slice();
      for (const [index, change] of changes || []) copy[index] = { ...copy[index], ...change };
      return copy;
    };
    this.materials = changed(this.head.materials, appearance.materials);
    this.lights = changed(this.head.lights, appearance.lights);
    this.cameras = changed(this.head.cameras, appearance.cameras);
    const visual = this.head.geoms.filter((geom) => !geom.collision);
    for (const [index, change] of appearance.geoms || []) visual[index] = { ...visual[index], ...change };
    this.visual = visual;
    this.scene = scene;
    this.look = look;
    this.made = [];
    this.shadows = [];  // LightShadow objects
    this.bodies = this.head.bodies.map((body) => this.makeBody(body));
    this.outlines = new Map();  // meshes by object
    this.visualMeshes = this.build(visual, (geom) => this.materialOf(geom));
    this.collisionMeshes = null;
    if (!this.isGhost) this.addLights();
    this.update(0);
  }

  makeBody(body) {
    if (!body.moves) return null;
    const group = new THREE.Group();
    group.name = body.name;
    this.root.add(group);
    return group;
  }

  kindOf(body) {
    const entity = this.head.entities[this.head.bodies[body].entity];
    return entity ? entity.kind : "world";
  }

  objectOf(body) {
    const entity = this.head.entities[this.head.bodies[body].entity];
    return entity && entity.object !== undefined && entity.object !== null ? entity.object : -1;
  }

  // Merges the geoms of a body, or of all static bodies, into one mesh per material.
  build(geoms, materialOf) {
    const groups = new Map();
    for (const geom of geoms) {
      const body = this.head.bodies[geom.body];
      if (this.isGhost && !body.moves) continue;
      const { key, make, repeat, object } = materialOf(geom);
      const place = body.moves ? geom.body : -1;
      const name = `${place} ${key}`;
      if (!groups.has(name)) groups.set(name, { place, key, make, object, parts: [] });
      const matrix = Evalbus.shapes.pose(geom.position_m, geom.quat_wxyz);
      if (!body.moves) matrix.premultiply(Evalbus.shapes.pose(body.position_m, body.quat_wxyz));
      const geometry = geom.shape === "mesh" ? this.scene.meshes.get(geom.mesh)
        : Evalbus.shapes.primitive(geom.shape, geom.size_m, 10 * (this.head.extent_m || 1));
      groups.get(name).parts.push({ geometry, matrix, repeat: repeat && repeat(geom) });
    }
    const materials = new Map(), meshes = [];
    for (const { place, key, make, object, parts } of groups.values()) {
      if (!materials.has(key)) materials.set(key, make());
      const geometry = Evalbus.shapes.merge(parts);
      const mesh = new THREE.Mesh(geometry, materials.get(key));
      this.made.push(geometry, materials.get(key));
      mesh.matrixAutoUpdate = false;
      mesh.castShadow = mesh.receiveShadow = !this.isGhost;
      mesh.object = object;
      (place >= 0 ? this.bodies[place] : this.root).add(mesh);
      meshes.push(mesh);
    }
    return meshes;
  }

  // Returns {key, make, object, repeat}, where make() creates a material that looks as in MuJoCo's OpenGL shading. There, the
  // maximum of a specular highlight is light times
  // material for any shininess. In three.js, the maximum increases with the shininess.
  materialOf(geom) {
    if (this.look) return { key: "ghost", make: () => this.ghostMaterial() };
    const own = geom.material === undefined || geom.material === null ? null : this.materials[geom.material];
    const rgba = geom.rgba || (own ? own.rgba : [0.5, 0.5, 0.5, 1]);
    const object = this.objectOf(geom.body);
    const texture = own && own.texture ? this.scene.textures.get(own.texture) : null;
    const key = `${geom.material} ${rgba} ${object}`;
    const make = () => {
      const shininess = Math.max(1, 128 * (own ? own.shininess : 0.5));
      const shine = (own ? own.specular : 0.5) * 0.6 / (0.25 * (shininess / 2 + 1));
      const color = new THREE.Color(rgba[0], rgba[1], rgba[2]);
      return new THREE.MeshPhongMaterial({
        color: color, specular: new THREE.Color(shine, shine, shine), shininess, map: texture,
        emissive: color.clone().multiplyScalar(own ? own.emission : 0),
        transparent: rgba[3] < 1, opacity: rgba[3], depthWrite: rgba[3] >= 1,
      });
    };
    return { key, make, object, repeat: texture ? (one) => this.repeatOf(own, one) : null };
  }

  // Returns the texture repetitions per meter along x and y. material.repeat is their number over the shape's size or, if
  // `uniform`, over 2 m.
  repeatOf(material, geom) {
    const [x, y] = geom.size_m || [1, 1];
    return material.repeat.map((times, k) => 0.5 * times / (material.uniform ? 1 : (k === 0 ? x : y) || 1));
  }

  ghostMaterial() {
    return new THREE.MeshPhongMaterial({
      color: this.look, emissive: new THREE.Color(this.look).multiplyScalar(0.25), specular: 0, transparent: true,
      opacity: 0.42, polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1,
    });
  }

  showCollision(isShown) {
    if (isShown && !this.collisionMeshes) {
      const colors = { robot: 0x5b8fb9, object: 0xe3a23a, fixture: 0xa9aeb3, world: 0x8d9297 };
      this.collisionMeshes = this.build(this.head.geoms.filter((geom) => geom.collision), (geom) => {
        if (this.look) return { key: "ghost", make: () => this.ghostMaterial() };
        const kind = this.kindOf(geom.body);
        return {
          key: `collision ${kind}`,
          make: () => new THREE.MeshPhongMaterial({ color: colors[kind], specular: 0x111111, shininess: 20 }),
        };
      });
    }
    for (const mesh of this.visualMeshes) mesh.visible = !isShown;
    for (const mesh of this.collisionMeshes || []) mesh.visible = isShown;
  }

  addLights() {
    const color = (rgb) => new THREE.Color(rgb[0], rgb[1], rgb[2]);
    const ambient = new THREE.Color(0, 0, 0);
    if (this.head.headlight) ambient.add(color(this.head.headlight.ambient));
    for (const light of this.lights) {
      ambient.add(color(light.ambient));
      this.root.add(...this.lightOf(light, color(light.diffuse)));
    }
    this.root.add(new THREE.AmbientLight(ambient));
  }

  lightOf(light, color) {
    const body = this.bodies[light.body];
    const still = this.head.bodies[light.body];
    const matrix = body || !still ? new THREE.Matrix4() : Evalbus.shapes.pose(still.position_m, still.quat_wxyz);
    const position = new THREE.Vector3(...light.position_m).applyMatrix4(matrix);
    const direction = new THREE.Vector3(...light.direction).transformDirection(matrix);
    const reach = this.head.extent_m || 1;
    let made;
    if (light.directional) {
      made = new THREE.DirectionalLight(color, 1);
      // The shadow camera is centered on the scene.
      const middle = new THREE.Vector3(...(this.head.center_m || [0, 0, 0]));
      made.target.position.copy(middle);
      made.position.copy(middle).addScaledVector(direction, -3 * reach);
      Object.assign(made.shadow.camera, { left: -1.1 * reach, right: 1.1 * reach, top: 1.1 * reach, bottom: -1.1 * reach,
        near: 0.5 * reach, far: 6 * reach });
    } else {
      const angle = Math.min(light.cutoff_deg || 45, 89) * Math.PI / 180;
      made = new THREE.SpotLight(color, 1, 0, angle, 0.3, 0);
      made.position.copy(position);
      made.target.position.copy(position).add(direction);
    }
    if (light.shadow) {
      made.castShadow = true;
      made.shadow.mapSize.set(2048, 2048);
      made.shadow.bias = -0.0006;
      made.shadow.radius = 1.6;
      this.shadows.push(made.shadow);
    }
    if (body) {
      body.add(made, made.target);
      return [];
    }
    return [made, made.target];
  }

  update(tick) {
    this.track.head.bodies.forEach((body, slot) => {
      const group = this.bodies[body];
      if (group && this.track.hasPoses()) this.track.poseAt(slot, tick, group.position, group.quaternion);
    });
  }

  // Outlines an object with the material of Evalbus.outlineMaterial(). object: -1 for none.
  outline(object, material) {
    if (object >= 0 && !this.outlines.has(object)) {
      this.outlines.set(object, this.visualMeshes.filter((mesh) => mesh.object === object).map((mesh) => {
        const outline = new THREE.Mesh(mesh.geometry, material);
        outline.matrixAutoUpdate = false;
        mesh.parent.add(outline);
        return outline;
      }));
    }
    const isVisual = this.visualMeshes.some((mesh) => mesh.visible);
    for (const [one, meshes] of this.outlines) {
      for (const mesh of meshes) mesh.visible = isVisual && one === object;
    }
  }

  // Converts a pose in a body's frame to the world frame.
  placeOf(body, position, quat, into) {
    const still = this.head.bodies[body];
    const group = this.bodies[body];
    const local = Evalbus.shapes.pose(position, quat);
    if (group) {
      group.updateMatrix();
      into.multiplyMatrices(group.matrix, local);
    } else {
      into.multiplyMatrices(Evalbus.shapes.pose(still.position_m, still.quat_wxyz), local);
    }
    return into;
  }

  dispose() {
    for (const one of this.made) one.dispose();
    for (const { map, mapPass } of this.shadows) {
      // Textures exist only if the shadow has been drawn.
      if (map) map.dispose();
      if (mapPass) mapPass.dispose();
    }
  }
};

// Draws the back faces of a mesh, enlarged by two pixels along its normals. Only the part outside the mesh's silhouette
// is visible. The uniform `pixel` is the size of a pixel in clip coordinates.
Evalbus.outlineMaterial = () => new THREE.ShaderMaterial({
  uniforms: { pixel: { value: new THREE.Vector2(0.002, 0.002) } },
  vertexShader: "uniform vec2 pixel; void main() { gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0); "
    + "vec2 way = (projectionMatrix * vec4(normalMatrix * normal, 0.0)).xy / pixel; "
    + "if (length(way) > 0.0) gl_Position.xy += 2.0 * normalize(way) * pixel * gl_Position.w; }",
  fragmentShader: "void main() { gl_FragColor = vec4(1.0); }",
  side: THREE.BackSide,
});
