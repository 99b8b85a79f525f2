// How a particle looks: one vertex shader that sizes it in world metres, one fragment shader per look.
//
// Colors arrive as authored (sRGB) with alpha, and leave premultiplied.  Two ways to blend:
//   additive: result = source + behind, into half floats, for glow.js to develop.  On a graphics card without them
//             source + (1 - source) * behind per channel: n layers of s give 1 - (1 - s)^n, so that an orange core still burns
//             to yellow and never clips to flat patches.  Either way the order of the particles does not matter.
//   alpha:    result = source + (1 - alpha) * behind, in order of birth.
"use strict";

const Looks = (() => {
  const T = MeshCat.THREE;

  // Far things take the color of the horizon; light fades, for the air adds none at night.
  const air = { near: { value: 1e9 }, far: { value: 2e9 }, color: { value: new T.Vector3() } };
  const HAZE = `
    uniform float hazeNear, hazeFar;
    uniform vec3 hazeColor;
    vec4 hazy(vec4 own, float depth) {
      float haze = 0.9 * smoothstep(hazeNear, hazeFar, depth);
      return ADDS == 1 ? vec4(own.rgb, own.a * (1.0 - haze)) : vec4(mix(own.rgb, hazeColor, haze), own.a);
    }`;
  const inAir = () => ({ hazeNear: air.near, hazeFar: air.far, hazeColor: air.color });

  const VERTEX = `
    precision highp float;
    attribute vec4 position;      // 0..1: place in the cloud's box; w: share of the largest size
    attribute vec4 color;         // 0..1, not premultiplied
    uniform mat4 modelViewMatrix, projectionMatrix;
    uniform vec3 extent, origin;  // the box [m]
    uniform float sizeMax;        // [m]
    uniform float viewHeight;     // of the picture [pixels]
    uniform float reach;          // drawn diameter over the particle's own
    uniform float leastPixels;    // smaller ones are drawn this large, and fainter in proportion if they fade
    uniform float fades;
    ${HAZE}
    varying vec4 tint;
    varying float pixels;
    void main() {
      gl_Position = projectionMatrix * (modelViewMatrix * vec4(position.xyz * extent + origin, 1.0));
      float wanted = position.w * sizeMax * reach * projectionMatrix[1][1] * 0.5 * viewHeight / gl_Position.w;
      pixels = max(wanted, leastPixels);
      gl_PointSize = pixels;
      float kept = min(wanted / leastPixels, 1.0);
      tint = hazy(vec4(color.rgb, color.a * mix(1.0, kept, fades)), gl_Position.w);  // by width, not area: a far spark is still a spark
      if (tint.a * wanted <= 0.0) gl_Position = vec4(2.0, 2.0, 2.0, 1.0);  // invisible: outside the picture
    }`;

  const HEAD = `
    precision highp float;
    varying vec4 tint;
    varying float pixels;`;

  // Bell-shaped: it ends smoothly at the rim, so that no disc shows.
  const GLOW = `${HEAD}
    void main() {
      vec2 p = gl_PointCoord * 2.0 - 1.0;
      float rim = max(1.0 - dot(p, p), 0.0);
      gl_FragColor = vec4(tint.rgb * (tint.a * rim * rim * rim * rim), 0.0);
    }`;

  const SOFT = `${HEAD}
    void main() {
      vec2 p = gl_PointCoord * 2.0 - 1.0;
      float rim = max(1.0 - dot(p, p), 0.0);
      float alpha = tint.a * rim * rim * (3.0 - 2.0 * rim);
      gl_FragColor = vec4(tint.rgb * alpha, alpha);
    }`;

  // A sphere lit from above left, its edge one pixel soft.
  const SPHERE = `${HEAD}
    void main() {
      vec2 p = gl_PointCoord * 2.0 - 1.0;
      p.y = -p.y;
      float r = length(p);
      float cover = clamp((1.0 - r) * 0.5 * pixels + 0.5, 0.0, 1.0);
      if (cover * tint.a < 0.004) discard;
      vec3 n = vec3(p, sqrt(max(1.0 - r * r, 0.0)));
      vec3 sun = normalize(vec3(-0.45, 0.75, 0.6));
      float lit = 0.42 + 0.66 * max(dot(n, sun), 0.0) + 0.08 * n.y;
      float shine = 0.35 * pow(max(dot(n, normalize(sun + vec3(0.0, 0.0, 1.0))), 0.0), 40.0);
      float shaded = smoothstep(2.0, 6.0, pixels);  // a dot of two pixels is only its color
      vec3 c = mix(tint.rgb, min(tint.rgb * lit + shine, 1.0), shaded);
      float alpha = cover * tint.a;
      gl_FragColor = vec4(c * alpha, ADDS == 1 ? 0.0 : alpha);
    }`;

  // A piece of a trail: thin and faint where it is old, wide and bright where the particle is.
  const TRAIL_VERTEX = `
    precision highp float;
    attribute vec2 corner;        // 0 or 1 along the piece, -1 or 1 across it
    attribute vec3 start, end;    // 0..1: places in the cloud's box
    attribute float along;        // 0..1: place of the start in its trail; below 0 between two trails
    attribute vec4 color;
    uniform mat4 modelViewMatrix, projectionMatrix;
    uniform vec3 extent, origin;
    uniform vec2 viewSize;        // [pixels]
    uniform float width, step;    // [m], share of a trail that a piece takes
    ${HAZE}
    varying vec4 tint;
    varying float side;
    void main() {
      vec4 from = projectionMatrix * (modelViewMatrix * vec4(start * extent + origin, 1.0));
      vec4 to = projectionMatrix * (modelViewMatrix * vec4(end * extent + origin, 1.0));
      vec4 at = corner.x < 0.5 ? from : to;
      vec2 run = (to.xy / to.w - from.xy / from.w) * viewSize;
      float reach = length(run), share = along + corner.x * step;
      float wanted = width * mix(0.15, 1.0, share) * projectionMatrix[1][1] * 0.5 * viewSize.y / at.w;
      float pixels = max(wanted, 1.5);
      at.xy += vec2(-run.y, run.x) / max(reach, 1e-6) * corner.y * pixels / viewSize * at.w;
      side = corner.y;
      tint = hazy(vec4(color.rgb, color.a * share * share * sqrt(min(wanted / 1.5, 1.0))), at.w);
      gl_Position = along < 0.0 || from.w <= 0.0 || to.w <= 0.0 || reach < 1e-3 ? vec4(2.0, 2.0, 2.0, 1.0) : at;
    }`;

  const TRAIL = `
    precision highp float;
    varying vec4 tint;
    varying float side;
    void main() {
      float alpha = tint.a * (1.0 - side * side);
      gl_FragColor = vec4(tint.rgb * alpha, ADDS == 1 ? 0.0 : alpha);
    }`;

  // A body along its heading: right, up and roll from the horizon; wings and tails move with the time of the frame.
  const BODY_VERTEX = `
    precision highp float;
    attribute vec3 position, normal;
    attribute float bend, phase;
    attribute vec4 place, color, heading;   // 0..1, w: share of the largest size; 0..1; -1..1, w: sine of the roll
    uniform mat4 modelViewMatrix, projectionMatrix;
    uniform vec3 extent, origin;
    uniform float sizeMax, time, beat, rolls, viewHeight;
    uniform vec2 swing;
    ${HAZE}
    varying vec4 tint;
    varying float lit;
    void main() {
      vec3 ahead = normalize(heading.xyz + vec3(1e-6, 0.0, 0.0));
      vec3 right = cross(ahead, vec3(0.0, 1.0, 0.0));
      right = length(right) < 1e-3 ? vec3(0.0, 0.0, 1.0) : normalize(right);
      vec3 up = cross(right, ahead);
      float s = clamp(heading.w * rolls, -0.95, 0.95), c = sqrt(1.0 - s * s);
      vec3 side = right * c - up * s;
      up = up * c + right * s;
      float turn = 6.2831853 * (time * beat + phase);
      vec3 p = position;
      p.y += swing.x * bend * sin(turn);                                   // wings
      p.z += swing.y * bend * bend * sin(turn - 3.0 * bend);               // a wave that runs to the tail
      float size = place.w * sizeMax;
      vec3 at = place.xyz * extent + origin;
      vec4 middle = projectionMatrix * (modelViewMatrix * vec4(at, 1.0));
      float pixels = size * projectionMatrix[1][1] * 0.5 * viewHeight / middle.w;
      float grown = max(1.0, 2.6 / max(pixels, 1e-3));                     // a far body is still a speck
      at += (ahead * p.x + up * p.y + side * p.z) * size * grown;
      gl_Position = projectionMatrix * (modelViewMatrix * vec4(at, 1.0));
      vec3 n = ahead * normal.x + up * normal.y + side * normal.z;
      float sun = abs(dot(n, normalize(vec3(-0.45, 0.8, 0.4))));
      lit = mix(1.0, 0.5 + 0.42 * sun + 0.16 * n.y, smoothstep(3.0, 12.0, pixels));
      tint = hazy(vec4(color.rgb, color.a * min(1.0, max(pixels / 2.6, 0.35))), middle.w);
      if (tint.a <= 0.0) gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
    }`;

  const BODY = `
    precision highp float;
    varying vec4 tint;
    varying float lit;
    void main() {
      gl_FragColor = vec4(min(tint.rgb * lit, 1.0) * tint.a, ADDS == 1 ? 0.0 : tint.a);
    }`;

  function blending(adds, inFloats) {
    return {
      transparent: true, depthTest: true, blending: T.CustomBlending, blendEquation: T.AddEquation,
      blendSrc: T.OneFactor, blendDst: !adds ? T.OneMinusSrcAlphaFactor : inFloats ? T.OneFactor : T.OneMinusSrcColorFactor,
      blendSrcAlpha: T.OneFactor, blendDstAlpha: T.OneMinusSrcAlphaFactor,
    };
  }

  function material(shape, blend, inFloats) {
    const adds = blend === "additive", sphere = shape === "points";
    return new T.RawShaderMaterial({
      vertexShader: VERTEX,
      fragmentShader: sphere ? SPHERE : adds ? GLOW : SOFT,
      defines: { ADDS: adds ? 1 : 0 },
      uniforms: {
        extent: { value: new T.Vector3(1, 1, 1) }, origin: { value: new T.Vector3() }, sizeMax: { value: 0 },
        viewHeight: { value: 1 }, reach: { value: sphere || !adds ? 1 : 1.6 },
        leastPixels: { value: sphere ? 1.5 : 2 }, fades: { value: sphere ? 0 : 1 }, ...inAir(),
      },
      depthWrite: sphere && !adds, ...blending(adds, inFloats),
    });
  }

  function trail(blend, inFloats) {
    const adds = blend === "additive";
    return new T.RawShaderMaterial({
      vertexShader: TRAIL_VERTEX,
      fragmentShader: TRAIL,
      defines: { ADDS: adds ? 1 : 0 },
      uniforms: {
        extent: { value: new T.Vector3(1, 1, 1) }, origin: { value: new T.Vector3() }, width: { value: 0.01 }, step: { value: 1 },
        viewSize: { value: new T.Vector2(1, 1) }, ...inAir(),
      },
      depthWrite: false, side: T.DoubleSide, ...blending(adds, inFloats),
    });
  }

  function body(kind, blend, inFloats) {
    const adds = blend === "additive";
    return new T.RawShaderMaterial({
      vertexShader: BODY_VERTEX,
      fragmentShader: BODY,
      defines: { ADDS: adds ? 1 : 0 },
      uniforms: {
        extent: { value: new T.Vector3(1, 1, 1) }, origin: { value: new T.Vector3() }, sizeMax: { value: 0 }, time: { value: 0 },
        beat: { value: kind.beat }, rolls: { value: kind.roll }, swing: { value: new T.Vector2(...kind.swing) },
        viewHeight: { value: 1 }, ...inAir(),
      },
      depthWrite: !adds, side: T.DoubleSide, ...blending(adds, inFloats),
    });
  }

  return { material, trail, body, air };
})();
