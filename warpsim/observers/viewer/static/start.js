"use strict";

// On the window, for the console and for tests.
var viewer = new MeshCat.Viewer(document.getElementById("meshcat-pane"));
var glow = new Glow(viewer);
var stage = new Stage(viewer, glow);
var controls = new Controls(viewer, new Lines(stage), new Nets(), (command) => stream.ask(command));
var stream = new Stream(viewer, stage, new Hud(document.getElementById("hud")), controls);

// A graphics card that lost its memory takes all buffers with it; a fresh page gets them all again.
viewer.renderer.domElement.addEventListener("webglcontextlost", () => setTimeout(() => location.reload(), 1000));
stream.connect();
