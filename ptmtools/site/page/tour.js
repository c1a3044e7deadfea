var b=class extends Error{constructor(e,t){super(t),this.code=e}};function R(n){let e=n.querySelector("nav"),t=n.querySelector("#panels");!e||!t||new ResizeObserver(()=>{e.offsetHeight&&(t.style.bottom=`${innerHeight-e.getBoundingClientRect().top+12}px`)}).observe(e)}function y(n,e){let t=n.querySelector(e);if(!t)throw new Error(`the page has no ${e}`);return t}function h(n,e={},...t){let o=document.createElement(n);for(let[s,i]of Object.entries(e))s in o?Reflect.set(o,s,i):o.setAttribute(s,i);return o.append(...t),o}var O=()=>matchMedia("(prefers-reduced-motion: reduce)").matches;function C(n){let e=new CSSStyleSheet;e.replaceSync(n),document.adoptedStyleSheets=[...document.adoptedStyleSheets,e]}var G=(n,e)=>Object.assign(e,Reflect.get(globalThis,"ptmWords")?.[n]);var p=G("tour",{label:"Label",tour:"Tour",stop:"Stop {number}",language:"Language",catalogue:"As a page of text and pictures",previous:"Previous",next:"Next",close:"Close",image:"Description of the picture",more:"More about it",unloaded:"The labels of the tour could not be loaded.",damaged:"The tour is damaged."});var v=(n,e)=>Array.isArray(n)&&n.length===e&&n.every(Number.isFinite);function N(n){if(!(Array.isArray(n?.languages)&&n.languages.every(t=>typeof t=="string")&&Array.isArray(n.labels)&&Array.isArray(n.stops)&&n.labels.every(t=>typeof t?.id=="string"&&v(t.marker,3)&&v(t.box,6)&&Number.isInteger(t.cell))&&n.stops.every(t=>v(t?.position,3)&&v(t.direction,3)&&(t.label===void 0||t.label in n.labels))))throw new b("PTM-V105",p.damaged);return n}function F(n,e){let t=o=>o.toLowerCase().split("-")[0];for(let o of e){let i=n.find(r=>r.toLowerCase()===o.toLowerCase())??n.find(r=>t(r)===t(o));if(i)return i}return n[0]??"en"}function z(n,e,t){if(!n||typeof n!="object")return null;let o=[e,"",t,...Object.keys(n)].find(s=>Object.hasOwn(n,s));return o===void 0?null:{text:n[o],tag:o}}var I={p:"p",h:"h3",em:"em",strong:"strong",code:"code",ul:"ul",ol:"ol",li:"li",quote:"blockquote",br:"br"},X=/^(https?|mailto):/i,K=32,M=n=>X.test(n);function k(n,e=0){return!Array.isArray(n)||e>K?[]:n.map(t=>{if(!Array.isArray(t))return String(t);let[o,...s]=t;if(o==="a"){let[r,...l]=s,a=k(l,e+1);return M(String(r))?h("a",{href:String(r),target:"_blank",rel:"noopener"},...a):h("span",{},...a)}let i=Object.hasOwn(I,o)?I[o]:"span";return h(i,{},...k(s,e+1))})}var V=(n,e,t={})=>e?[h(n,{...t,lang:e.tag,dir:"auto"},String(e.text))]:[];function D(n,e,{choose:t,urlOf:o,close:s,ways:i}){let r=t(e.title)??{text:e.id,tag:""},l=t(e.maker),a=t(e.date),c=[l,a].filter(g=>g!==null),u=t(e.text),m=t(e.image),d=t(e.link),f=h("h2",{tabIndex:-1,lang:r.tag,dir:"auto"},String(r.text));return n.replaceChildren(h("button",{className:"close",ariaLabel:p.close,onclick:s},"×"),f,...c.length?[h("p",{className:"by"},...J(c))]:[],...u?[h("div",{lang:u.tag,dir:"auto"},...k(u.text))]:[],...Z(e,t,o),...m?[h("details",{},h("summary",{},p.image),...V("p",m))]:[],...d&&M(d.text)?[h("p",{},h("a",{href:d.text,target:"_blank",rel:"noopener"},p.more))]:[],h("p",{className:"row"},...i.map(({text:g,go:w})=>h("button",{onclick:w},g)))),f}var J=n=>n.flatMap((e,t)=>[...t?[", "]:[],...V("span",e)]);function Z(n,e,t){let o=e(n.sound),s=e(n.captions);if(!o)return[];let i=h("audio",{controls:!0,preload:"none",src:t(String(o.text))});if(!s)return[i];let r=h("track",{kind:"captions",default:!0,srclang:s.tag||"und"}),l=h("p",{className:"captions",lang:s.tag,dir:"auto"});return i.onplay=()=>{r.src||(r.src=t(String(s.text))),r.track.mode="hidden"},r.track.oncuechange=()=>{let a=[...r.track.activeCues??[]];l.textContent=a.map(c=>c.getCueAsHTML().textContent).join(`
`)},i.append(r),[i,l]}var L=(n="",e="")=>`#version 300 es
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
}`,ee=`
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
}`,te=`#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
in vec2 spot;
in vec3 painted;
uniform float cutoff;
uniform sampler2D lightmap;
uniform float lit;
out vec4 shown;
${ee}
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
}`,_=`
vec2 bytes(float number) {
  float high = floor(number / 256.0);
  return vec2(number - 256.0 * high, high) / 255.0;
}`,oe=`#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
uniform float item;
uniform vec2 size;
uniform float pixels;
out vec4 shown;
${_}
void main(){
float w=gl_FragCoord.w;
vec2 texels=uv*size;
vec2 across=(dFdx(texels*w)-texels*dFdx(w))/w;
vec2 up=(dFdy(texels*w)-texels*dFdy(w))/w;
float most=max(dot(across,across),dot(up,up));
float detail=0.5*log2(max(most,1e-30))-log2(pixels);
shown=vec4(bytes(item),bytes(floor(256.0*clamp(detail,0.0,31.0))));
}`,ne=`#version 300 es
precision highp float;
uniform float item;
layout(location=1)out vec4 shown;
${_}
void main(){shown=vec4(bytes(item),0.0,1.0);}`,U={surface:[L(`
layout(location = 3) in vec2 place2;
out vec2 spot;`,"spot = place2;"),te],item:[L(),oe],placeholder:[L(),ne]};function $(n,e,t=U[e]){let o=n.createProgram(),s=[n.VERTEX_SHADER,n.FRAGMENT_SHADER];if(t.forEach((l,a)=>{let c=n.createShader(s[a]);n.shaderSource(c,l),n.compileShader(c),n.attachShader(o,c),n.deleteShader(c)}),n.linkProgram(o),!n.getProgramParameter(o,n.LINK_STATUS)&&!n.isContextLost())throw new Error(`${e}: ${n.getProgramInfoLog(o)}`);let i={},r=n.isContextLost()?0:n.getProgramParameter(o,n.ACTIVE_UNIFORMS);for(let l=0;l<r;l++){let a=n.getActiveUniform(o,l)?.name??"";i[a]=n.getUniformLocation(o,a)}return{program:o,at:i}}function j(n,{program:e,at:t},o){n.useProgram(e),n.uniform3fv(t.eye,o.eye),n.uniformMatrix3fv(t.turn,!1,o.turn),n.uniform4fv(t.lens,o.lens)}function P({eye:n,yaw:e,pitch:t},o,s,i){let[r,l,a,c]=[Math.sin(e),Math.cos(e),Math.sin(t),Math.cos(t)],u=[l,r*a,r*c,0,c,-a,-r,l*a,l*c],m=1/Math.tan(o/2),d=.1-i;return{eye:n,turn:u,lens:[m/s,m,(i+.1)/d,2*i*.1/d]}}var se=15,ie=24,re=.03,q=.15,S=8,ae=`#version 300 es
precision highp float;
uniform vec3 eye;
uniform mat3 turn;
uniform vec4 lens;
uniform vec3 point;
void main(){
vec3 seen=turn*(point-eye);
gl_Position=vec4(seen.xy*lens.xy,seen.z*lens.z+lens.w,-seen.z);
gl_PointSize=1.0;
}`,le=`#version 300 es
precision mediump float;
out vec4 shown;
void main() { shown = vec4(0.0); }`,T=class{#t=[];#o=[];#s=null;#n=null;#e=new Map;current=-1;constructor(e,t,{nameOf:o,open:s}){this.walk=e,this.labels=t,this.nameOf=o,this.open=s,this.root=h("div",{id:"markers"}),e.canvas.after(this.root),e.probe=i=>this.#a(i),e.turn(),e.canvas.addEventListener("webglcontextlost",()=>{this.#s=null,this.#o=[]})}get shown(){return[...this.#e.keys()]}#i(e){let t=new Set(this.walk.visible);return this.labels.map(({marker:o,cell:s},i)=>{let r=Math.hypot(...o.map((l,a)=>l-e[a]));return{label:i,away:s<0||t.has(s)?r:1/0}}).filter(({away:o})=>o<se).sort((o,s)=>o.away-s.away).slice(0,ie)}#a(e){let{gl:t}=this.walk;if(this.#r(),!this.#o.length){this.#s??=$(t,"markers",[ae,le]),this.#n??=t.createVertexArray(),j(t,this.#s,e),t.bindVertexArray(this.#n),t.colorMask(!1,!1,!1,!1),t.depthMask(!1);for(let{label:o,away:s}of this.#i(e.eye)){let i=t.createQuery();if(!i)break;let r=Math.max(0,1-re-q/Math.max(s,q)),l=this.labels[o].marker.map((a,c)=>e.eye[c]+(a-e.eye[c])*r);t.uniform3fv(this.#s.at.point,l),t.beginQuery(t.ANY_SAMPLES_PASSED_CONSERVATIVE,i),t.drawArrays(t.POINTS,0,1),t.endQuery(t.ANY_SAMPLES_PASSED_CONSERVATIVE),this.#o.push({label:o,query:i})}t.colorMask(!0,!0,!0,!0),t.depthMask(!0)}}#r(){let{gl:e}=this.walk,t=this.#o,o=t.at(-1);if(!(!o||!e.getQueryParameter(o.query,e.QUERY_RESULT_AVAILABLE))){this.#t=[];for(let{label:s,query:i}of t)this.#t[s]=!!e.getQueryParameter(i,e.QUERY_RESULT),e.deleteQuery(i);this.#o=[]}}place(e){let{walk:t}=this,{clientWidth:o,clientHeight:s}=t.canvas;this.#r();let{eye:i,turn:r,lens:l}=P(e,t.tall,t.aspect,t.far),a=new Map;for(let{label:c}of this.#i(i)){if(!this.#t[c])continue;let[u,m,d]=this.labels[c].marker.map((x,Y)=>x-i[Y]),f=[0,1,2].map(x=>r[x]*u+r[x+3]*m+r[x+6]*d);if(f[2]>=0)continue;let g=(.5-f[0]*l[0]/f[2]/2)*o,w=(.5+f[1]*l[1]/f[2]/2)*s;if(g<-S||w<-S||g>o+S||w>s+S)continue;let A=this.#e.get(c)??this.#l(c);A.style.transform=`translate(${g.toFixed(1)}px,${w.toFixed(1)}px)`,A.toggleAttribute("aria-current",c===this.current),a.set(c,A)}for(let[c,u]of this.#e)a.has(c)||(u===document.activeElement?a.set(c,u):u.remove());this.#e=a}#l(e){let t=this.nameOf(e),o=h("button",{title:t,ariaLabel:t});return o.onclick=()=>this.open(e),this.root.append(o),o}rename(){for(let[e,t]of this.#e)t.title=t.ariaLabel=this.nameOf(e)}rayAt(e,t,o){let{walk:s}=this,{clientWidth:i,clientHeight:r}=s.canvas,{eye:l,turn:a,lens:c}=P(e,s.tall,s.aspect,s.far),u=[(2*t/i-1)/c[0],(1-2*o/r)/c[1],-1],m=[0,1,2].map(d=>a[3*d]*u[0]+a[3*d+1]*u[1]+a[3*d+2]*u[2]);return{eye:l,ray:m}}renew(e){let{gl:t}=this.walk,o=new Map(this.labels.map((s,i)=>[B(s),this.#t[i]]));this.labels=e,this.#t=e.map(s=>o.get(B(s))??!1);for(let{query:s}of this.#o)t.deleteQuery(s);this.#o=[];for(let s of this.#e.values())s.remove();this.#e.clear(),this.walk.turn()}at(e,t,o){let{eye:s,ray:i}=this.rayAt(e,t,o),r=-1,l=1/0;for(let{label:a}of this.#i(s)){if(!this.#t[a])continue;let c=ce(s,i,this.labels[a].box);c<l&&([r,l]=[a,c])}return r}},B=({id:n,marker:e})=>`${n} ${e}`;function ce(n,e,t){let o=0,s=1/0;for(let i=0;i<3;i++){let r=(t[i]-n[i])/e[i],l=(t[i+3]-n[i])/e[i];o=Math.max(o,Math.min(r,l)||o),s=Math.min(s,Number.isNaN(Math.max(r,l))?s:Math.max(r,l))}return o<=s?o:1/0}var H=`
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
#label h2 { font-size: 20px; line-height: 1.25; margin: 0 0 4px; margin-inline-end: 44px; }
#label h3 { color: inherit; font-size: 15px; }
#label .by { color: var(--dim); margin: 0 0 10px; }
#label p, #label li { max-width: 65ch; }
#label blockquote { margin: 8px 0; padding-inline-start: 12px; border-inline-start: 3px solid var(--line); }
#label audio { width: 100%; margin: 8px 0 0; }
#label .captions { min-height: 3em; margin: 6px 0 0; padding: 8px 10px; background: #000; border-radius: 8px; }
#label .captions:empty { display: none; }
#label .close { float: inline-end; width: 44px; padding: 0; margin: -4px 0 0; margin-inline-end: -6px; }
#label details summary { min-height: 32px; cursor: pointer; color: var(--dim); }
@media (forced-colors: active) { #markers button::before { border-color: CanvasText; forced-color-adjust: none; } }
`;var De=Promise.resolve();var W=(n,e)=>n.replace(/\{(\w+)\}/g,(t,o)=>e[o]);var he=6,ue=500;async function pe(n,e){let t=new URL(e,document.baseURI).href;try{let o=await n.walk.fetcher.whole(t,s=>N(JSON.parse(new TextDecoder().decode(s))));return Q(),new E(n,o,t)}catch(o){let s=o instanceof b?o.code:"PTM-V105";return n.walk.faults.push({code:s,message:String(o)}),n.emit("notice",{message:p.unloaded}),null}}function Q(){C(H),R(document)}var E=class{open=-1;stop=-1;pick=null;#t=null;constructor(e,t,o){this.app=e,this.tour=t,this.url=o;let s=new URLSearchParams(location.search),i=s.get("lang");this.language=F(t.languages,[...i?[i]:[],...navigator.languages]),this.panel=h("section",{id:"label",ariaLabel:p.label,hidden:!0}),this.list=h("section",{id:"tour",ariaLabel:p.tour,tabIndex:0,hidden:!0}),y(document,"#panels").append(this.list,this.panel),this.button=h("button",{"aria-controls":"tour","aria-expanded":"false"},p.tour),this.button.onclick=()=>this.#e(this.list.hidden),y(document,"nav").prepend(this.button),this.markers=new T(e.walk,t.labels,{nameOf:a=>this.nameOf(a),open:a=>this.show(a)}),this.#n(),this.#s();let r=t.labels.findIndex(({id:a})=>a===s.get("label")),l=s.get("stop")??"";r>=0?this.visit(r):/^\d+$/.test(l)&&Number(l)in t.stops&&this.go(Number(l))}choose=e=>z(e,this.language,this.tour.languages[0]);nameOf(e){let{id:t,title:o,maker:s}=this.tour.labels[e];return[this.choose(o)?.text??t,this.choose(s)?.text].filter(Boolean).join(", ")}#o(e){let{title:t,label:o}=this.tour.stops[e];return this.choose(t)?.text??(o===void 0?W(p.stop,{number:e+1}):this.nameOf(o))}#s(){let{app:e}=this,{canvas:t}=e,o=()=>{e.walk.begun&&this.markers.place(e.walker.pose),requestAnimationFrame(o)};requestAnimationFrame(o);let s=null;t.addEventListener("pointerdown",i=>s=i.isPrimary?i:null),t.addEventListener("pointerup",i=>{if(!s||i.pointerId!==s.pointerId)return;let r=Math.hypot(i.clientX-s.clientX,i.clientY-s.clientY),l=i.timeStamp-s.timeStamp>ue;if(s=null,r>he||l)return;if(this.pick)return this.pick(i.clientX,i.clientY);let a=this.markers.at(e.walker.pose,i.clientX,i.clientY);a>=0&&this.show(a)}),addEventListener("keydown",({code:i,target:r,ctrlKey:l,altKey:a,metaKey:c})=>{l||a||c||r instanceof Element&&r.closest("input, select, textarea, audio")||(i==="KeyN"&&this.step(1),i==="KeyP"&&this.step(-1),i==="Escape"&&(this.panel.hidden?this.list.hidden||this.#e(!1):this.close()))})}#n(){let{languages:e,stops:t,title:o}=this.tour,s=this.choose(o),i=h("h2",{lang:s?.tag??"",dir:"auto"},s?.text??p.tour),r=t.map((u,m)=>{let d=h("button",{dir:"auto",onclick:()=>this.go(m)},this.#o(m));return m===this.stop&&d.setAttribute("aria-current","true"),h("li",{},d)}),l=e.map(u=>h("option",{value:u,selected:u===this.language},de(u))),a=h("select",{ariaLabel:p.language,onchange:()=>this.speak(a.value)},...l),{catalogue:c=""}=this.app.config;this.list.replaceChildren(i,...e.length>1?[a]:[],h("ol",{},...r),...c?[h("p",{},h("a",{href:c},p.catalogue))]:[])}speak(e){this.speakQuietly(e),y(this.list,"select").focus()}speakQuietly(e){this.language=e,this.#n(),this.markers.rename(),this.open>=0&&this.show(this.open,!0)}#e(e){this.list.hidden=!e,this.button.setAttribute("aria-expanded",String(e)),!e&&this.list.contains(document.activeElement)&&this.button.focus()}renew(e){this.tour=e,this.markers.renew(e.labels),e.languages.includes(this.language)||(this.language=e.languages[0]),this.stop in e.stops||(this.stop=-1),this.#n(),this.open in e.labels?this.show(this.open,!0):this.panel.hidden||this.close()}show(e,t=!1){let{panel:o,tour:s}=this,i=document.activeElement;o.hidden&&(this.#t=i instanceof HTMLElement?i:null),this.open=this.markers.current=e,o.hidden=!1,matchMedia("(max-width: 640px)").matches&&this.#e(!1);let r=s.stops.length>1?[{text:p.previous,go:()=>this.step(-1)},{text:p.next,go:()=>this.step(1)}]:[],l=D(o,s.labels[e],{choose:this.choose,urlOf:a=>new URL(a,this.url).href,close:()=>this.close(),ways:r});t||(l.focus({preventScroll:!0}),o.scrollTop=0,this.app.emit("label",s.labels[e].id))}close(){let{panel:e}=this,t=e.contains(document.activeElement);e.hidden=!0,e.replaceChildren(),this.open=this.markers.current=-1;let o=this.#t?.isConnected?this.#t:this.app.canvas;t&&o.focus()}visit(e){let t=this.tour.stops.findIndex(o=>o.label===e);t>=0?this.go(t):this.show(e)}step(e){let{length:t}=this.tour.stops;t&&this.go((Math.max(this.stop,e>0?-1:0)+e+t)%t)}go(e){let{app:t,tour:o}=this,{position:s,direction:[i,r,l],label:a}=o.stops[e],c=Math.asin(Math.max(-1,Math.min(1,r/Math.hypot(i,r,l))));this.stop=e,t.follow({eye:[...s],yaw:Math.atan2(-i,-l),pitch:c}),O()||t.canvas.animate([{opacity:0},{opacity:1}],250),this.#n(),a!==void 0?this.show(a):this.panel.hidden||this.close()}};function de(n){try{return new Intl.DisplayNames([n],{type:"language"}).of(n)??n}catch{return n}}export{E as Tour,Q as addTourStyle,pe as attachTour};
