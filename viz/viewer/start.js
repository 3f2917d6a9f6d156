// SPDX-License-Identifier: BSD-3-Clause
// Starts the viewer in the page's element for it.
function start(root) {
  const pieces = new Map();
  for (const piece of root.querySelectorAll('.pv-data')) pieces.set(Number(piece.dataset.n), piece);
  const data = (number) => {
    const piece = pieces.get(number), bytes = bytesOf(piece.textContent);
    piece.remove();
    pieces.delete(number);
    return bytes;
  };
  const scene = JSON.parse(root.querySelector('.pv-scene').textContent);
  try {
    root.viewer = new Panel(root, scene, data);
  } catch (e) {
    root.classList.add('pv-none');
    root.querySelector('.pv-still').hidden = false;
    root.querySelectorAll('canvas').forEach((c) => c.remove());
    root.dataset.failed = e.message;
    return;
  }
  const { view } = root.viewer;
  if (!scene.clouds.some((c) => c.colored) && scene.clouds.length) view.setLayer('height');
  view.load();
  if (scene.live) listen(root.viewer);
}
document.querySelectorAll('.pv').forEach(start);
