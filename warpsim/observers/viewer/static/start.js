"use strict";

// On the window, for the console and for tests.
var viewer = new MeshCat.Viewer(document.getElementById("meshcat-pane"));
var glow = new Glow(viewer);
var stream = new Stream(viewer, new Stage(viewer, glow), new Hud(document.getElementById("hud")));

// A graphics card that lost its memory takes all buffers with it; a fresh page gets them all again.
viewer.renderer.domElement.addEventListener("webglcontextlost", () => setTimeout(() => location.reload(), 1000));
stream.connect();
