// Geometries of a scene: MuJoCo's primitive shapes, meshes from blocks, and merged geometries.
"use strict";

Evalbus.shapes = {
  // size: MuJoCo's half sizes. Capsules and cylinders are aligned with z. far: half size with which an
  // infinite plane is drawn.
  primitive(shape, size, far) {
    const [x, y, z] = size;
    const upright = (geometry) => geometry.rotateX(Math.PI / 2);
    switch (shape) {
      case "box": return new THREE.BoxBufferGeometry(2 * x, 2 * y, 2 * z);
      case "sphere": return upright(new THREE.SphereBufferGeometry(x, 32, 20));
      case "ellipsoid": return upright(new THREE.SphereBufferGeometry(1, 32, 20)).scale(x, y, z);
      case "cylinder": return upright(new THREE.CylinderBufferGeometry(x, x, 2 * y, 40));
      case "capsule": return upright(Evalbus.shapes.capsule(x, y));
      case "plane": return new THREE.PlaneBufferGeometry(2 * (x || far), 2 * (y || far));
      default: throw new Error(`the scene has a geom of the unknown shape ${Evalbus.words(shape)}`);
    }
  },

  capsule(radius, half) {
    const outline = [];
    for (let k = 0; k <= 24; ++k) {
      const angle = -Math.PI / 2 + Math.PI * k / 24;
      outline.push(new THREE.Vector2(Math.max(1e-6, radius * Math.cos(angle)),
        radius * Math.sin(angle) + (k < 12 ? -half : half)));
    }
    return new THREE.LatheBufferGeometry(outline, 28);
  },

  mesh(block) {
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(block.values("vertices_m"), 3));
    geometry.setIndex(new THREE.BufferAttribute(block.raw("faces"), 1));
    if (block.has("uv")) geometry.setAttribute("uv", new THREE.BufferAttribute(block.values("uv"), 2));
    if (block.has("normals")) {
      geometry.setAttribute("normal", new THREE.BufferAttribute(block.values("normals"), 3));
      return geometry;
    }
    // If the block contains no normals, faces are flat-shaded.
    const flat = geometry.toNonIndexed();
    flat.computeVertexNormals();
    return flat;
  },

  pose(position, quat) {
    const [w, x, y, z] = quat || [1, 0, 0, 0];
    return new THREE.Matrix4().compose(new THREE.Vector3(...(position || [0, 0, 0])), new THREE.Quaternion(x, y, z, w),
      new THREE.Vector3(1, 1, 1));
  },

  // Merges many {geometry, matrix, repeat} into one geometry. repeat: texture repetitions per meter. The texture of a shape
  // without texture coordinates is projected along the shape's z axis, as in MuJoCo.
  merge(parts) {
    let vertices = 0, corners = 0;
    for (const { geometry } of parts) {
      vertices += geometry.attributes.position.count;
      corners += geometry.index ? geometry.index.count : geometry.attributes.position.count;
    }
    const position = new Float32Array(3 * vertices), normal = new Float32Array(3 * vertices);
    const isPainted = parts.some((part) => part.repeat);
    const uv = isPainted ? new Float32Array(2 * vertices) : null;
    const index = new (vertices > 65535 ? Uint32Array : Uint16Array)(corners);
    const point = new THREE.Vector3(), turn = new THREE.Matrix3();
    let v = 0, c = 0;
    for (const { geometry, matrix, repeat } of parts) {
      const count = geometry.attributes.position.count;
      const from = geometry.attributes.position.array, normals = geometry.attributes.normal.array;
      turn.getNormalMatrix(matrix);
      for (let i = 0; i < count; ++i) {
        point.fromArray(from, 3 * i).applyMatrix4(matrix).toArray(position, 3 * (v + i));
        point.fromArray(normals, 3 * i).applyMatrix3(turn).normalize().toArray(normal, 3 * (v + i));
        if (!repeat) continue;
        const own = geometry.attributes.uv && geometry.isOwnUv;
        uv[2 * (v + i)] = own ? geometry.attributes.uv.array[2 * i] : repeat[0] * from[3 * i] - 0.5;
        uv[2 * (v + i) + 1] = own ? geometry.attributes.uv.array[2 * i + 1] : -repeat[1] * from[3 * i + 1] - 0.5;
      }
      if (geometry.index) {
        for (let i = 0; i < geometry.index.count; ++i) index[c++] = v + geometry.index.array[i];
      } else {
        for (let i = 0; i < count; ++i) index[c++] = v + i;
      }
      v += count;
    }
    const merged = new THREE.BufferGeometry();
    merged.setAttribute("position", new THREE.BufferAttribute(position, 3));
    merged.setAttribute("normal", new THREE.BufferAttribute(normal, 3));
    if (uv) merged.setAttribute("uv", new THREE.BufferAttribute(uv, 2));
    merged.setIndex(new THREE.BufferAttribute(index, 1));
    return merged;
  },
};
