var x=class extends Error{constructor(e,t){super(t),this.code=e}};function R(n){let e=n.querySelector("nav"),t=n.querySelector("#panels");!e||!t||new ResizeObserver(()=>{e.offsetHeight&&(t.style.bottom=`${innerHeight-e.getBoundingClientRect().top+12}px`)}).observe(e)}function y(n,e){let t=n.querySelector(e);if(!t)throw new Error(`the page has no ${e}`);return t}function h(n,e={},...t){let o=document.createElement(n);for(let[s,i]of Object.entries(e))s in o?Reflect.set(o,s,i):o.setAttribute(s,i);return o.append(...t),o}var O=()=>matchMedia("(prefers-reduced-motion: reduce)").matches;function C(n){let e=new CSSStyleSheet;e.replaceSync(n),document.adoptedStyleSheets=[...document.adoptedStyleSheets,e]}var Y=(n,e)=>Object.assign(e,Reflect.get(globalThis,"ptmWords")?.[n]);var p=Y("tour",{label:"Label",tour:"Tour",stop:"Stop {number}",language:"Language",catalogue:"As a page of text and pictures",previous:"Previous",next:"Next",close:"Close",image:"Description of the picture",more:"More about it",unloaded:"The labels of the tour could not be loaded.",damaged:"The tour is damaged."});var k=(n,e)=>Array.isArray(n)&&n.length===e&&n.every(Number.isFinite);function F(n){if(!(Array.isArray(n?.languages)&&n.languages.every(t=>typeof t=="string")&&Array.isArray(n.labels)&&Array.isArray(n.stops)&&n.labels.every(t=>typeof t?.id=="string"&&k(t.marker,3)&&k(t.box,6)&&Number.isInteger(t.cell))&&n.stops.every(t=>k(t?.position,3)&&k(t.direction,3)&&(t.label===void 0||t.label in n.labels))))throw new x("PTM-V105",p.damaged);return n}function N(n,e){let t=o=>o.toLowerCase().split("-")[0];for(let o of e){let i=n.find(r=>r.toLowerCase()===o.toLowerCase())??n.find(r=>t(r)===t(o));if(i)return i}return n[0]??"en"}function L(n,e,t){if(!n||typeof n!="object")return null;let o=[e,"",t,...Object.keys(n)].find(s=>Object.hasOwn(n,s));return o===void 0?null:{text:n[o],tag:o}}var z={p:"p",h:"h3",em:"em",strong:"strong",code:"code",ul:"ul",ol:"ol",li:"li",quote:"blockquote",br:"br"},G=/^(https?|mailto):/i,X=32,M=n=>G.test(n);function S(n,e=0){return!Array.isArray(n)||e>X?[]:n.map(t=>{if(!Array.isArray(t))return String(t);let[o,...s]=t;if(o==="a"){let[r,...a]=s,l=S(a,e+1);return M(String(r))?h("a",{href:String(r),target:"_blank",rel:"noopener"},...l):h("span",{},...l)}let i=Object.hasOwn(z,o)?z[o]:"span";return h(i,{},...S(s,e+1))})}var I=(n,e,t={})=>e?[h(n,{...t,lang:e.tag,dir:"auto"},String(e.text))]:[];function V(n,e,{choose:t,urlOf:o,close:s,ways:i}){let r=t(e.title)??{text:e.id,tag:""},a=t(e.maker),l=t(e.date),c=[a,l].filter(f=>f!==null),u=t(e.text),m=t(e.image),d=t(e.link),g=h("h2",{tabIndex:-1,lang:r.tag,dir:"auto"},String(r.text));return n.replaceChildren(h("button",{className:"close",ariaLabel:p.close,onclick:s},"×"),g,...c.length?[h("p",{className:"by"},...K(c))]:[],...u?[h("div",{lang:u.tag,dir:"auto"},...S(u.text))]:[],...J(e,t,o),...m?[h("details",{},h("summary",{},p.image),...I("p",m))]:[],...d&&M(d.text)?[h("p",{},h("a",{href:d.text,target:"_blank",rel:"noopener"},p.more))]:[],h("p",{className:"row"},...i.map(({text:f,go:b})=>h("button",{onclick:b},f)))),g}var K=n=>n.flatMap((e,t)=>[...t?[", "]:[],...I("span",e)]);function J(n,e,t){let o=e(n.sound),s=e(n.captions);if(!o)return[];let i=h("audio",{controls:!0,preload:"none",src:t(String(o.text))});if(!s)return[i];let r=h("track",{kind:"captions",default:!0,srclang:s.tag||"und"}),a=h("p",{className:"captions",lang:s.tag,dir:"auto"});return i.onplay=()=>{r.src||(r.src=t(String(s.text))),r.track.mode="hidden"},r.track.oncuechange=()=>{let l=[...r.track.activeCues??[]];a.textContent=l.map(c=>c.getCueAsHTML().textContent).join(`
`)},i.append(r),[i,a]}var P=(n="",e="")=>`#version 300 es
precision highp float;
uniform vec3 eye;
uniform mat3 turn;
uniform vec4 lens;
layout(location=0)in vec3 position;
layout(location=1)in vec2 place;
layout(location=2)in vec4 paint;
out vec3 seen;
out vec2 uv;
out vec3 painted;${n}
void main(){
${e}
painted=paint.rgb;
seen=turn*(position-eye);
uv=place;
gl_Position=vec4(seen.xy*lens.xy,seen.z*lens.z+lens.w,-seen.z);
}`,Z=`
uniform sampler2D map;
uniform int channels;
uniform vec4 color;
uniform vec3 mean;
uniform bool textured;
vec4 texel(){
vec4 sampled=texture(map,uv);
if(channels==1)sampled=vec4(sampled.rrr,1.0);
if(channels==2)sampled=sampled.rrrg;
return channels==0?vec4(mean,1.0):sampled;
}`,ee=`#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
in vec2 spot;
in vec3 painted;
uniform float cutoff;
uniform sampler2D lightmap;
uniform float lit;
out vec4 shown;
${Z}
void main(){
vec4 sampled=texel();
float light=1.0;
if(!textured){
sampled=vec4(1.0);
float glow=lit !=0.0?0.7:0.25;
vec3 normal=cross(dFdx(seen),dFdy(seen));
float size=length(normal);
light=glow+(1.0-glow)*(size > 0.0?abs(dot(normal,normalize(seen)))/size:1.0);
}
if(lit !=0.0)light*=1.055*pow(lit < 0.0?texture(lightmap,spot).r:lit,1.0/2.4)-0.055;
shown=vec4(sampled.rgb*color.rgb*painted*light,sampled.a*color.a);
if(shown.a < max(cutoff,0.004))discard;
if(cutoff > 0.0)shown.a=1.0;
}`,D=`
vec2 bytes(float number) {
  float high = floor(number / 256.0);
  return vec2(number - 256.0 * high, high) / 255.0;
}`,te=`#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
uniform float item;
uniform vec2 size;
uniform float pixels;
out vec4 shown;
${D}
void main(){
float w=gl_FragCoord.w;
vec2 texels=uv*size;
vec2 across=(dFdx(texels*w)-texels*dFdx(w))/w;
vec2 up=(dFdy(texels*w)-texels*dFdy(w))/w;
float most=max(dot(across,across),dot(up,up));
float detail=0.5*log2(max(most,1e-30))-log2(pixels);
shown=vec4(bytes(item),bytes(floor(256.0*clamp(detail,0.0,31.0))));
}`,oe=`#version 300 es
precision highp float;
uniform float item;
layout(location=1)out vec4 shown;
${D}
void main(){shown=vec4(bytes(item),0.0,1.0);}`,_={surface:[P(`
layout(location = 3) in vec2 place2;
out vec2 spot;`,"spot = place2;"),ee],item:[P(),te],placeholder:[P(),oe]};function $(n,e,t=_[e]){let o=n.createProgram(),s=[n.VERTEX_SHADER,n.FRAGMENT_SHADER];if(t.forEach((a,l)=>{let c=n.createShader(s[l]);n.shaderSource(c,a),n.compileShader(c),n.attachShader(o,c),n.deleteShader(c)}),n.linkProgram(o),!n.getProgramParameter(o,n.LINK_STATUS)&&!n.isContextLost())throw new Error(`${e}: ${n.getProgramInfoLog(o)}`);let i={},r=n.isContextLost()?0:n.getProgramParameter(o,n.ACTIVE_UNIFORMS);for(let a=0;a<r;a++){let l=n.getActiveUniform(o,a)?.name??"";i[l]=n.getUniformLocation(o,l)}return{program:o,at:i}}function U(n,{program:e,at:t},o){n.useProgram(e),n.uniform3fv(t.eye,o.eye),n.uniformMatrix3fv(t.turn,!1,o.turn),n.uniform4fv(t.lens,o.lens)}var ne=15,se=24,ie=.03,j=.15,T=8,re=`#version 300 es
precision highp float;
uniform vec3 eye;
uniform mat3 turn;
uniform vec4 lens;
uniform vec3 point;
void main(){
vec3 seen=turn*(point-eye);
gl_Position=vec4(seen.xy*lens.xy,seen.z*lens.z+lens.w,-seen.z);
gl_PointSize=1.0;
}`,ae=`#version 300 es
precision mediump float;
out vec4 shown;
void main() { shown = vec4(0.0); }`,E=class{#e=[];#t=[];#n=null;#s=null;#o=new Map;current=-1;constructor(e,t,{nameOf:o,open:s}){this.walk=e,this.labels=t,this.nameOf=o,this.open=s,this.root=h("div",{id:"markers"}),e.viewport.canvas.after(this.root),e.needs.probe=i=>this.#r(i),e.picture.turn(),e.viewport.canvas.addEventListener("webglcontextlost",()=>{this.#n=null,this.#t=[]})}get shown(){return[...this.#o.keys()]}#i(e){let t=new Set(this.walk.visible);return this.labels.map(({marker:o,cell:s},i)=>{let r=Math.hypot(...o.map((a,l)=>a-e[l]));return{label:i,away:s<0||t.has(s)?r:1/0}}).filter(({away:o})=>o<ne).sort((o,s)=>o.away-s.away).slice(0,se)}#r(e){let{gl:t}=this.walk;if(this.#a(),!this.#t.length){this.#n??=$(t,"markers",[re,ae]),this.#s??=t.createVertexArray(),U(t,this.#n,e),t.bindVertexArray(this.#s),t.colorMask(!1,!1,!1,!1),t.depthMask(!1);for(let{label:o,away:s}of this.#i(e.eye)){let i=t.createQuery();if(!i)break;let r=Math.max(0,1-ie-j/Math.max(s,j)),a=this.labels[o].marker.map((l,c)=>e.eye[c]+(l-e.eye[c])*r);t.uniform3fv(this.#n.at.point,a),t.beginQuery(t.ANY_SAMPLES_PASSED_CONSERVATIVE,i),t.drawArrays(t.POINTS,0,1),t.endQuery(t.ANY_SAMPLES_PASSED_CONSERVATIVE),this.#t.push({label:o,query:i})}t.colorMask(!0,!0,!0,!0),t.depthMask(!0)}}#a(){let{gl:e}=this.walk,t=this.#t,o=t.at(-1);if(!(!o||!e.getQueryParameter(o.query,e.QUERY_RESULT_AVAILABLE))){this.#e=[];for(let{label:s,query:i}of t)this.#e[s]=!!e.getQueryParameter(i,e.QUERY_RESULT),e.deleteQuery(i);this.#t=[]}}place(e){let{walk:t}=this,{clientWidth:o,clientHeight:s}=t.viewport.canvas;this.#a();let{eye:i,turn:r,lens:a}=t.viewport.camera(e),l=new Map;for(let{label:c}of this.#i(i)){if(!this.#e[c])continue;let[u,m,d]=this.labels[c].marker.map((v,Q)=>v-i[Q]),g=[0,1,2].map(v=>r[v]*u+r[v+3]*m+r[v+6]*d);if(g[2]>=0)continue;let f=(.5-g[0]*a[0]/g[2]/2)*o,b=(.5+g[1]*a[1]/g[2]/2)*s;if(f<-T||b<-T||f>o+T||b>s+T)continue;let w=this.#o.get(c)??this.#l(c);w.style.transform=`translate(${f.toFixed(1)}px,${b.toFixed(1)}px)`,w.toggleAttribute("aria-current",c===this.current),l.set(c,w)}for(let[c,u]of this.#o)l.has(c)||(u===document.activeElement?l.set(c,u):u.remove());this.#o=l}#l(e){let t=this.nameOf(e),o=h("button",{title:t,ariaLabel:t});return o.onclick=()=>this.open(e),this.root.append(o),o}rename(){for(let[e,t]of this.#o)t.title=t.ariaLabel=this.nameOf(e)}rayAt(e,t,o){let{walk:s}=this,{clientWidth:i,clientHeight:r}=s.viewport.canvas,{eye:a,turn:l,lens:c}=s.viewport.camera(e),u=[(2*t/i-1)/c[0],(1-2*o/r)/c[1],-1],m=[0,1,2].map(d=>l[3*d]*u[0]+l[3*d+1]*u[1]+l[3*d+2]*u[2]);return{eye:a,ray:m}}renew(e){let{gl:t}=this.walk,o=new Map(this.labels.map((s,i)=>[q(s),this.#e[i]]));this.labels=e,this.#e=e.map(s=>o.get(q(s))??!1);for(let{query:s}of this.#t)t.deleteQuery(s);this.#t=[];for(let s of this.#o.values())s.remove();this.#o.clear(),this.walk.picture.turn()}at(e,t,o){let{eye:s,ray:i}=this.rayAt(e,t,o),r=-1,a=1/0;for(let{label:l}of this.#i(s)){if(!this.#e[l])continue;let c=le(s,i,this.labels[l].box);c<a&&([r,a]=[l,c])}return r}},q=({id:n,marker:e})=>`${n} ${e}`;function le(n,e,t){let o=0,s=1/0;for(let i=0;i<3;i++){let r=(t[i]-n[i])/e[i],a=(t[i+3]-n[i])/e[i];o=Math.max(o,Math.min(r,a)||o),s=Math.min(s,Number.isNaN(Math.max(r,a))?s:Math.max(r,a))}return o<=s?o:1/0}var B=`
#markers { position: fixed; inset: 0; pointer-events: none; overflow: hidden; }
#markers button { position: absolute; left: 0; top: 0; width: 44px; min-height: 44px; height: 44px; margin: -22px; padding: 0; border: 0; border-radius: 50%; background: none; pointer-events: auto; }
#markers button::before { content: ""; position: absolute; inset: 11px; border: 2px solid #16171b; border-radius: 50%; background: var(--ink); box-shadow: 0 0 0 2px #fffc, 0 2px 8px #000a; }
#markers button:hover::before, #markers button:focus-visible::before, #markers [aria-current]::before { background: var(--warm); inset: 8px; }
#markers button:focus-visible { outline-offset: -2px; }
#tour, #label { margin-inline-start: auto; }
#tour ol { list-style: none; margin: 0; padding: 0; display: grid; gap: 6px; }
#tour li button { width: 100%; text-align: start; padding: 8px 12px; background: #ffffff0d; }
#tour li small { display: block; color: var(--dim); font-size: 13px; }
#tour [aria-current] { border-color: var(--warm); }
#tour select { width: 100%; margin: 0 0 10px; }
#label h2 { font-size: 20px; line-height: 1.25; margin: 0 0 4px; display: flow-root; }
#label h3 { color: inherit; font-size: 15px; }
#label .by { color: var(--dim); margin: 0 0 10px; }
#label p, #label li { max-width: 65ch; }
#label blockquote { margin: 8px 0; padding-inline-start: 12px; border-inline-start: 3px solid var(--line); }
#label audio { width: 100%; margin: 8px 0 0; }
#label .captions { min-height: 3em; margin: 6px 0 0; padding: 8px 10px; background: #000; border-radius: 8px; }
#label .captions:empty { display: none; }
#label .close { float: inline-end; width: 44px; padding: 0; margin: -4px 0 0; margin-inline: 8px -6px; }
#label details summary { min-height: 32px; cursor: pointer; color: var(--dim); }
@media (forced-colors: active) { #tour [aria-current] { border: 3px solid Highlight; } #markers button::before { border-color: CanvasText; forced-color-adjust: none; } }
`;var ze=Promise.resolve();var H=(n,e)=>n.replace(/\{(\w+)\}/g,(t,o)=>e[o]);var ce=6,he=500;async function ue(n,e){let t=new URL(e,document.baseURI).href;try{let o=await n.walk.stream.fetcher.whole(t,s=>F(JSON.parse(new TextDecoder().decode(s))));return W(),new A(n,o,t)}catch(o){let s=o instanceof x?o.code:"PTM-V105";return n.walk.faults.push({code:s,message:String(o)}),n.emit("notice",{message:p.unloaded}),null}}function W(){C(B),R(document)}var A=class{open=-1;stop=-1;pick=null;#e=null;constructor(e,t,o){this.app=e,this.tour=t,this.url=o;let s=new URLSearchParams(location.search),i=s.get("lang");this.language=N(t.languages,[...i?[i]:[],...navigator.languages]),this.panel=h("section",{id:"label",ariaLabel:p.label,hidden:!0}),this.list=h("section",{id:"tour",ariaLabel:p.tour,tabIndex:0,hidden:!0}),y(document,"#panels").append(this.list,this.panel),this.button=h("button",{"aria-controls":"tour","aria-expanded":"false"},p.tour);let r=y(document,"nav"),a=matchMedia("(max-width: 640px)");this.button.onclick=()=>this.#r(this.list.hidden),r.addEventListener("click",({target:u})=>{let m=u.closest("[aria-controls]");if(!(!a.matches||!m||m.getAttribute("aria-expanded")!=="true"))for(let d of r.querySelectorAll("[aria-expanded=true]"))d!==m&&d.click()}),r.prepend(this.button),this.markers=new E(e.walk,t.labels,{nameOf:u=>this.nameOf(u),open:u=>this.show(u)}),this.#s(),this.#n();let l=t.labels.findIndex(({id:u})=>u===s.get("label")),c=s.get("stop")??"";l>=0?this.visit(l):/^\d+$/.test(c)&&Number(c)in t.stops&&this.go(Number(c))}choose=e=>L(e,this.language,this.tour.languages[0]);nameOf(e){let{id:t,title:o,maker:s}=this.tour.labels[e];return[this.choose(o)?.text??t,this.choose(s)?.text].filter(Boolean).join(", ")}#t(e){let{title:t,label:o}=this.tour.stops[e];return this.choose(t)?.text??(o===void 0?H(p.stop,{number:e+1}):this.nameOf(o))}#n(){let{app:e}=this,{canvas:t}=e,o=()=>{e.walk.begun&&this.markers.place(e.walker.pose),requestAnimationFrame(o)};requestAnimationFrame(o);let s=null;t.addEventListener("pointerdown",i=>s=i.isPrimary?i:null),t.addEventListener("pointerup",i=>{if(!s||i.pointerId!==s.pointerId)return;let r=Math.hypot(i.clientX-s.clientX,i.clientY-s.clientY),a=i.timeStamp-s.timeStamp>he;if(s=null,r>ce||a)return;if(this.pick)return this.pick(i.clientX,i.clientY);let l=this.markers.at(e.walker.pose,i.clientX,i.clientY);l>=0&&this.show(l)}),addEventListener("keydown",({code:i,target:r,ctrlKey:a,altKey:l,metaKey:c})=>{a||l||c||r instanceof Element&&r.closest("input, select, textarea, audio")||(i==="KeyN"&&this.step(1),i==="KeyP"&&this.step(-1),i==="Escape"&&(this.panel.hidden?this.list.hidden||this.#r(!1):this.close()))})}#s(){this.#i(),this.#o()}#o(){let{title:e,places:t={}}=this.tour,{config:o,index:s}=this.app,i=this.choose(e);i&&o.title===L(e,"",this.tour.languages[0])?.text&&(y(document,"title").lang=i.tag,document.title=String(i.text));for(let r of s.viewpoints)r.title=Object.hasOwn(t,r.description)?this.choose(t[r.description]):null;for(let r of["#places","#map"])y(document,r).dispatchEvent(new Event("rename"))}#i(){let{languages:e,stops:t,labels:o,title:s,description:i}=this.tour,r=this.choose(s),a=this.choose(i);this.button.hidden=!(t.length||o.length||a||e.length>1);let l=h("h2",{lang:r?.tag??"",dir:"auto"},r?.text??p.tour),c=t.map((f,b)=>{let w=h("button",{dir:"auto",onclick:()=>this.go(b)},this.#t(b));return b===this.stop&&w.setAttribute("aria-current","true"),h("li",{},w)}),u=e.map(f=>h("option",{value:f,selected:f===this.language},pe(f))),m=h("select",{ariaLabel:p.language,onchange:()=>this.speak(m.value)},...u),{catalogue:d=""}=this.app.config,g=this.language===e[0]?d:d.replace(/(?=\.html$)/,`-${this.language}`);this.list.replaceChildren(l,...a?[h("p",{lang:a.tag,dir:"auto"},String(a.text))]:[],...e.length>1?[m]:[],h("ol",{},...c),...g?[h("p",{},h("a",{href:g},p.catalogue))]:[])}speak(e){this.speakQuietly(e),y(this.list,"select").focus()}speakQuietly(e){this.language=e,this.#s(),this.markers.rename(),this.open>=0&&this.show(this.open,!0)}#r(e){this.list.hidden=!e,this.button.setAttribute("aria-expanded",String(e)),!e&&this.list.contains(document.activeElement)&&this.button.focus()}renew(e){this.tour=e,this.markers.renew(e.labels),e.languages.includes(this.language)||(this.language=e.languages[0]),this.stop in e.stops||(this.stop=-1),this.#s(),this.open in e.labels?this.show(this.open,!0):this.panel.hidden||this.close()}show(e,t=!1){let{panel:o,tour:s}=this,i=document.activeElement;o.hidden&&(this.#e=i instanceof HTMLElement?i:null),this.open=this.markers.current=e,o.hidden=!1,matchMedia("(max-width: 640px)").matches&&this.#r(!1);let r=s.stops.length>1?[{text:p.previous,go:()=>this.step(-1)},{text:p.next,go:()=>this.step(1)}]:[],a=V(o,s.labels[e],{choose:this.choose,urlOf:l=>new URL(l,this.url).href,close:()=>this.close(),ways:r});t||(a.focus({preventScroll:!0}),o.scrollTop=0,this.app.emit("label",s.labels[e].id))}close(){let{panel:e}=this,t=e.contains(document.activeElement);e.hidden=!0,e.replaceChildren(),this.open=this.markers.current=-1;let o=this.#e?.isConnected?this.#e:this.app.canvas;t&&o.focus()}visit(e){let t=this.tour.stops.findIndex(o=>o.label===e);t>=0?this.go(t):this.show(e)}step(e){let{length:t}=this.tour.stops;t&&this.go((Math.max(this.stop,e>0?-1:0)+e+t)%t)}go(e){let{app:t,tour:o}=this,{position:s,direction:[i,r,a],label:l}=o.stops[e],c=Math.asin(Math.max(-1,Math.min(1,r/Math.hypot(i,r,a))));this.stop=e,t.follow({eye:[...s],yaw:Math.atan2(-i,-a),pitch:c}),O()||t.canvas.animate([{opacity:0},{opacity:1}],250),this.#i(),l!==void 0?this.show(l):this.panel.hidden||this.close()}};function pe(n){try{return new Intl.DisplayNames([n],{type:"language"}).of(n)??n}catch{return n}}export{A as Tour,W as addTourStyle,ue as attachTour};
