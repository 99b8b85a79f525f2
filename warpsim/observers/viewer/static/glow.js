// Light that adds up outgrows what a screen can show.  A night scene is therefore drawn into half floats first; its bright
// parts spill over their surroundings, as in an eye or a lens, and a tone curve brings the sum back to the screen.
// Without floats to draw into (an old graphics card) the scene is drawn as ever, with blending that saturates: see looks.js.
"use strict";

class Glow {
  constructor(viewer) {
    const T = MeshCat.THREE;
    this.on = false;
    this.renderer = viewer.renderer;
    this.draw = viewer.renderer.render.bind(viewer.renderer);
    const gl = this.renderer.getContext();
    this.possible = this.renderer.capabilities.isWebGL2 && gl.getExtension("EXT_color_buffer_float") !== null;
    if (!this.possible) return;
    const options = { type: T.HalfFloatType, format: T.RGBAFormat, minFilter: T.LinearFilter, magFilter: T.LinearFilter };
    this.light = new T.WebGLRenderTarget(1, 1, options);
    // Each half as wide as the one before: blurring there is cheap, and wide once it is enlarged again.
    this.levels = Array.from({ length: 6 }, () => new T.WebGLRenderTarget(1, 1, { ...options, depthBuffer: false }));
    this.shrink = Glow.pass(Glow.SHRINK, { picture: null, texel: new T.Vector2() });
    this.enlarge = Glow.pass(Glow.ENLARGE, { picture: null, texel: new T.Vector2() });
    this.enlarge.blending = T.CustomBlending;
    this.enlarge.blendSrc = this.enlarge.blendDst = T.OneFactor;
    this.develop = Glow.pass(Glow.DEVELOP, { picture: null, spill: null });
    this.sheet = new T.Mesh(new T.PlaneGeometry(2, 2), this.shrink);
    this.sheet.frustumCulled = false;
    this.lens = new T.OrthographicCamera(-1, 1, 1, -1, 0, 1);
    this.size = new T.Vector2();
    this.renderer.render = (scene, camera) => this.render(scene, camera);
  }

  render(scene, camera) {
    if (!this.on || this.renderer.getRenderTarget() !== null) {
      this.draw(scene, camera);
      return;
    }
    this.fit();
    this.renderer.setRenderTarget(this.light);
    this.draw(scene, camera);
    let from = this.light;
    for (const level of this.levels) {
      this.run(this.shrink, from, level);
      from = level;
    }
    this.renderer.autoClear = false;
    for (let i = this.levels.length - 1; i > 0; i--) this.run(this.enlarge, this.levels[i], this.levels[i - 1]);
    this.renderer.autoClear = true;
    this.develop.uniforms.spill.value = this.levels[0].texture;
    this.run(this.develop, this.light, null);
  }

  run(material, from, to) {
    const { uniforms } = material;
    uniforms.picture.value = from.texture;
    if (uniforms.texel !== undefined) uniforms.texel.value.set(1 / from.width, 1 / from.height);
    this.sheet.material = material;
    this.renderer.setRenderTarget(to);
    this.draw(this.sheet, this.lens);
  }

  fit() {
    const { x, y } = this.renderer.getDrawingBufferSize(this.size);
    if (this.light.width === x && this.light.height === y) return;
    this.light.setSize(x, y);
    this.levels.forEach((level, i) => level.setSize(Math.max(x >> (i + 1), 1), Math.max(y >> (i + 1), 1)));
  }

  static pass(fragment, values) {
    const T = MeshCat.THREE, uniforms = {};
    for (const [name, value] of Object.entries(values)) uniforms[name] = { value };
    const vertexShader = `
      attribute vec3 position;
      varying vec2 at;
      void main() { at = 0.5 * position.xy + 0.5; gl_Position = vec4(position.xy, 0.0, 1.0); }`;
    const head = "precision highp float; varying vec2 at; uniform sampler2D picture; uniform vec2 texel;";
    const flat = { depthTest: false, depthWrite: false, blending: T.NoBlending };
    return new T.RawShaderMaterial({ vertexShader, fragmentShader: head + fragment, uniforms, ...flat });
  }
}

// Dual filtering: five taps down, eight taps up.  Source: M. Bjorge, Bandwidth-efficient rendering, SIGGRAPH 2015.
Glow.SHRINK = `
  void main() {
    vec3 sum = 4.0 * texture2D(picture, at).rgb;
    for (int i = 0; i < 4; i++) {
      vec2 corner = vec2(i < 2 ? -1.0 : 1.0, i == 0 || i == 2 ? -1.0 : 1.0);
      sum += texture2D(picture, at + corner * texel).rgb;
    }
    gl_FragColor = vec4(min(sum / 8.0, 64.0), 1.0);
  }`;
Glow.ENLARGE = `
  void main() {
    vec2 h = 0.5 * texel;
    vec3 sum = texture2D(picture, at + vec2(-2.0 * h.x, 0.0)).rgb + texture2D(picture, at + vec2(2.0 * h.x, 0.0)).rgb
             + texture2D(picture, at + vec2(0.0, -2.0 * h.y)).rgb + texture2D(picture, at + vec2(0.0, 2.0 * h.y)).rgb;
    sum += 2.0 * (texture2D(picture, at + h).rgb + texture2D(picture, at - h).rgb
                + texture2D(picture, at + vec2(h.x, -h.y)).rgb + texture2D(picture, at + vec2(-h.x, h.y)).rgb);
    gl_FragColor = vec4(sum / 12.0, 0.0);
  }`;
// First the sum is held back, hue kept, so that forty sparks are not forty times one; then each channel bends into white on
// its own, the strongest first, as film does: red turns orange, orange yellow, only the palest turns white.
Glow.DEVELOP = `
  uniform sampler2D spill;
  void main() {
    vec3 light = texture2D(picture, at).rgb + 0.06 * texture2D(spill, at).rgb;
    float most = max(max(light.r, light.g), max(light.b, 1e-4));
    float held = most < 0.6 ? most : 0.6 + 0.42 * log(1.0 + (most - 0.6) / 0.42);
    vec3 color = light * (held / most);
    color = mix(color, 1.0 - 0.5 * exp(1.0 - 2.0 * color), step(0.5, color));
    float grain = fract(sin(dot(gl_FragCoord.xy, vec2(12.9898, 78.233))) * 43758.5453) - 0.5;  // no bands in the dark
    gl_FragColor = vec4(color + grain / 255.0, 1.0);
  }`;
