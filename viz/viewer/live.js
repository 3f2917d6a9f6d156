// SPDX-License-Identifier: BSD-3-Clause
// Shows a growing map: its parts and the robots' poses arrive as server-sent events. Only in pages that are served by
// a run.
function listen(panel) {
  const { view, scene } = panel, source = new EventSource(scene.live + location.search);
  let known = 0;

  /** Adds a keyframe's cloud; it replaces an earlier one. */
  const piece = async ({ key, robot, cloud }) => {
    const made = new CloudData(cloud, (n) => bytesOf(cloud.data[n]), view.base);
    for (const chunk of made.chunks) await made.open(chunk);
    Object.assign(made, { key, robot, visible: !panel.pointsHidden });
    const { gl } = view.painter;
    for (const { array, buffers } of view.clouds.filter((c) => c.key === key).flatMap((c) => c.chunks)) {
      if (array) gl.deleteVertexArray(array), buffers.forEach((b) => gl.deleteBuffer(b));
    }
    view.clouds = [...view.clouds.filter((c) => c.key !== key), made];
    for (const chunk of made.chunks) await view.paint(made, chunk);
    const box = ['low', 'high'].map((side, i) => [0, 1, 2].map((k) => (i ? Math.max : Math.min)(...view.clouds.flatMap((c) => c.chunks.map((q) => q[side][k])))));
    scene.inmost = box;
    view.measure();
    if (++known === 1 || known === 8) view.home();
    view.again();
  };

  const robots = (list) => {
    panel.live = list;
    scene.paths = list.map(({ name, number, path }) => ({ name, robot: number, t: path.map((_, i) => i), p: path.flat(), q: path.flatMap(() => [0, 0, 0, 1]) }));
    panel.buildSets();
  };

  let waiting = Promise.resolve();
  source.onmessage = (event) => {
    const news = JSON.parse(event.data);
    if (news.cloud) waiting = waiting.then(() => piece(news));
    if (news.robots) robots(news.robots);
    if (news.told) panel.say(news.told);
    if (news.done) {
      source.close();
      panel.say('the run has ended; this is its map');
    }
  };
  source.onerror = () => panel.say('no word of the run; trying again');
}
