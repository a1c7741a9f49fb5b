// Keys and legend.

import { html, type Html } from './text';

export const kKeys: [string, string][] = [
  ['Space', 'play or pause'],
  ['← →', 'previous or next epoch; with Shift ten'],
  ['Home, End', 'beginning, end of the run'],
  ['+ −', 'faster, slower'],
  ['L', 'to the next loss of fix'],
  ['E', 'to the largest horizontal error'],
  ['V', 'validation: to where recorded and simulated pseudoranges differ most; again: next street'],
  ['1 2 3 4', 'camera: free, follow, top, first person'],
  ['N', 'next satellite; Shift+N: the previous one (in the table: Tab and Enter)'],
  ['P', 'the next click puts an antenna there; Shift+click does so at once'],
  ['Esc', 'clear the selection; remove the antenna'],
  ['C', 'buildings by height or by material'],
  ['D', 'light or dark'],
  ['M , .', 'heat map: show or hide; previous, next time'],
  ['?', 'this help'],
];

export function helpHtml(): Html {
  return html`<h2>Keys and legend <form method="dialog" style="float:right"><button>Close</button></form></h2>
  <div class="columns"><table>${kKeys.map(([key, what]) => html`<tr><th>${key}</th><td>${what}</td></tr>`)}
    <tr><th>mouse</th><td>drag: rotate; right button or Shift: move; wheel: zoom; click: select a building; Shift+click: put an antenna there</td></tr>
    <tr><th>touch</th><td>one finger: rotate; two: zoom</td></tr>
  </table><table>
    <tr><th>satellites</th><td>are on a dome around the antenna, at their true directions. Disc and green: line of sight.
      Square, blue: line of sight with echoes. Triangle, orange: echoes only (NLOS). Cross, grey: no trackable signal.
      Pale: not used in the fix.</td></tr>
    <tr><th>rays</th><td>are the signal paths over reflection points and edges. Thin ones are scattered or more than
      20 dB weaker than a clear line of sight. With a satellite selected only its own are shown.</td></tr>
    <tr><th>dark line</th><td>the true track of the antenna; orange-red where there was no fix.</td></tr>
    <tr><th>pink line</th><td>the fixes, drawn at the antenna’s height. The pink mark is the fix of this instant, at its own height;
      the ellipse around it is the 95 % region of the covariance reported by the receiver; the orange-red line is the error.</td></tr>
    <tr><th>several<br>receivers</th><td>have their own colours and shapes; the panels show the one selected above.</td></tr>
    <tr><th>validation</th><td>recorded and simulated fixes; the bars along the street are the rms of the pseudorange errors of each, 1 m
      high per metre. Green, blue, orange and grey are the satellite's visibility by the city.</td></tr>
    <tr><th>sky plot</th><td>north up, zenith in the middle; grey is hidden by buildings, dashed the elevation mask.</td></tr>
    <tr><th>an antenna<br>put somewhere</th><td>is a stationary receiver of the scenario, just switched on there: the running
      <code>canyon view</code> computes it. It follows the time.</td></tr>
    <tr><th>time bar</th><td>orange-red: no fix. Brackets: active faults.</td></tr>
    <tr><th>heat map</th><td>the cells of a map at their computed height. Grey: no value there (no fix, or nothing
      received). Clear: inside a building, or outside the area.</td></tr>
    <tr><th>frame</th><td>east, north, up in metres from the city’s origin (WGS 84); azimuths from north, clockwise. Times: UTC, and seconds
      since the beginning.</td></tr>
  </table></div>
  <p class="hint">The engine computes; this page only draws its results and uses no network.</p>`;
}
