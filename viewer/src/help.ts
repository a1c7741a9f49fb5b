// Keys and what is what.

import { html, type Html } from './text';

export const kKeys: [string, string][] = [
  ['Space', 'play or pause'],
  ['← →', 'an epoch back or on; with Shift ten'],
  ['Home, End', 'begin, end of the run'],
  ['+ −', 'faster, slower'],
  ['L', 'to the next loss of fix'],
  ['E', 'to the largest horizontal error'],
  ['V', 'validation: to where recorded and simulated pseudoranges differ most; again: next street'],
  ['1 2 3 4', 'camera: free, follow, top, first person'],
  ['N', 'next satellite; Shift+N: the one before (in the table: Tab and Enter)'],
  ['P', 'the next click puts an antenna there; Shift+click does so at once'],
  ['Esc', 'select nothing; take the antenna away'],
  ['C', 'buildings by height or by material'],
  ['D', 'light or dark'],
  ['M , .', 'heat map: show or hide; the time before, the next'],
  ['?', 'this help'],
];

export function helpHtml(): Html {
  return html`<h2>What is what <form method="dialog" style="float:right"><button>Close</button></form></h2>
  <div class="columns"><table>${kKeys.map(([key, what]) => html`<tr><th>${key}</th><td>${what}</td></tr>`)}
    <tr><th>mouse</th><td>drag: turn; right button or Shift: move; wheel: nearer; click: select a building; Shift+click: put an antenna there</td></tr>
    <tr><th>touch</th><td>one finger: turn; two: nearer</td></tr>
  </table><table>
    <tr><th>satellites</th><td>stand on a dome about the antenna, at their true directions. Disc and green: line of sight.
      Square, blue: line of sight with echoes. Triangle, orange: echoes only (NLOS). Cross, grey: nothing that this receiver can track.
      Pale: not used in the fix.</td></tr>
    <tr><th>rays</th><td>are the ways of the signals, over reflection points and edges. Thin ones are scattered or more than
      20 dB weaker than a clear line of sight. With a satellite selected only its own are shown.</td></tr>
    <tr><th>dark line</th><td>the true track of the antenna; orange-red where there was no fix.</td></tr>
    <tr><th>pink line</th><td>the fixes, drawn at the antenna’s height. The pink mark is the fix of this instant, at its own height;
      the ellipse about it should hold 95 % of the truth by the covariance that the receiver states; the orange-red line is the error.</td></tr>
    <tr><th>several<br>receivers</th><td>have colours and shapes of their own; the panels show the one chosen above.</td></tr>
    <tr><th>validation</th><td>recorded and simulated fixes; the bars along the street are the rms of the pseudorange errors of each, a metre
      high for a metre. Green, blue, orange and grey are what the city says of a satellite.</td></tr>
    <tr><th>sky plot</th><td>north up, zenith in the middle; grey is hidden by buildings, dashed the elevation mask.</td></tr>
    <tr><th>an antenna<br>put somewhere</th><td>is a receiver of the scenario, just switched on there and standing still: the running
      <code>canyon view</code> traces it. It follows the time.</td></tr>
    <tr><th>time bar</th><td>orange-red: no fix. Brackets: faults at work.</td></tr>
    <tr><th>heat map</th><td>the cells of a map at the height that they were computed at. Grey: no value there (no fix, or nothing
      received). Clear: inside a building, or outside the area.</td></tr>
    <tr><th>frame</th><td>east, north, up in metres about the city’s origin (WGS 84); azimuths from north, clockwise. Times: UTC, and seconds
      since the begin.</td></tr>
  </table></div>
  <p class="hint">The engine computes; this page only draws what it wrote, and loads nothing from any network.</p>`;
}
