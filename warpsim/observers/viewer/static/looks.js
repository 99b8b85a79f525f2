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
    varying vec4 tint;
    varying float pixels;
    void main() {
      gl_Position = projectionMatrix * (modelViewMatrix * vec4(position.xyz * extent + origin, 1.0));
      float wanted = position.w * sizeMax * reach * projectionMatrix[1][1] * 0.5 * viewHeight / gl_Position.w;
      pixels = max(wanted, leastPixels);
      gl_PointSize = pixels;
      float kept = min(wanted / leastPixels, 1.0);
      tint = vec4(color.rgb, color.a * mix(1.0, kept, fades));  // by width, not area: a far spark is still a spark
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

  function material(shape, blend, inFloats) {
    const adds = blend === "additive", sphere = shape === "points";
    return new T.RawShaderMaterial({
      vertexShader: VERTEX,
      fragmentShader: sphere ? SPHERE : adds ? GLOW : SOFT,
      defines: { ADDS: adds ? 1 : 0 },
      uniforms: {
        extent: { value: new T.Vector3(1, 1, 1) }, origin: { value: new T.Vector3() }, sizeMax: { value: 0 },
        viewHeight: { value: 1 }, reach: { value: sphere || !adds ? 1 : 1.6 },
        leastPixels: { value: sphere ? 1.5 : 2 }, fades: { value: sphere ? 0 : 1 },
      },
      transparent: true, depthTest: true, depthWrite: sphere && !adds,
      blending: T.CustomBlending, blendEquation: T.AddEquation,
      blendSrc: T.OneFactor, blendDst: !adds ? T.OneMinusSrcAlphaFactor : inFloats ? T.OneFactor : T.OneMinusSrcColorFactor,
      blendSrcAlpha: T.OneFactor, blendDstAlpha: T.OneMinusSrcAlphaFactor,
    });
  }

  return { material };
})();
