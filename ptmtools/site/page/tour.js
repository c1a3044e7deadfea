var g=class extends Error{constructor(t,e){super(e),this.code=t}};function y(i,t){let e=i.querySelector(t);if(!e)throw new Error(`the page has no ${t}`);return e}function h(i,t={},...e){let n=document.createElement(i);for(let[s,o]of Object.entries(t))s in n?Reflect.set(n,s,o):n.setAttribute(s,o);return n.append(...e),n}var O=()=>matchMedia("(prefers-reduced-motion: reduce)").matches;function N(i){let t=new CSSStyleSheet;t.replaceSync(i),document.adoptedStyleSheets=[...document.adoptedStyleSheets,t]}var v=(i,t)=>Array.isArray(i)&&i.length===t&&i.every(Number.isFinite);function R(i){if(!(Array.isArray(i?.languages)&&i.languages.every(e=>typeof e=="string")&&Array.isArray(i.labels)&&Array.isArray(i.stops)&&i.labels.every(e=>typeof e?.id=="string"&&v(e.marker,3)&&v(e.box,6)&&Number.isInteger(e.cell))&&i.stops.every(e=>v(e?.position,3)&&v(e.direction,3)&&(e.label===void 0||e.label in i.labels))))throw new g("PTM-V105","The tour is damaged.");return i}function P(i,t){let e=n=>n.toLowerCase().split("-")[0];for(let n of t){let o=i.find(r=>r.toLowerCase()===n.toLowerCase())??i.find(r=>e(r)===e(n));if(o)return o}return i[0]??"en"}function C(i,t,e){if(!i||typeof i!="object")return null;let n=[t,"",e,...Object.keys(i)].find(s=>Object.hasOwn(i,s));return n===void 0?null:{text:i[n],tag:n}}var F={p:"p",h:"h3",em:"em",strong:"strong",code:"code",ul:"ul",ol:"ol",li:"li",quote:"blockquote",br:"br"},j=/^(https?|mailto):/i,H=32,M=i=>j.test(i);function w(i,t=0){return!Array.isArray(i)||t>H?[]:i.map(e=>{if(!Array.isArray(e))return String(e);let[n,...s]=e;if(n==="a"){let[r,...l]=s,a=w(l,t+1);return M(String(r))?h("a",{href:String(r),target:"_blank",rel:"noopener"},...a):h("span",{},...a)}let o=Object.hasOwn(F,n)?F[n]:"span";return h(o,{},...w(s,t+1))})}var I=(i,t,e={})=>t?[h(i,{...e,lang:t.tag,dir:"auto"},String(t.text))]:[];function _(i,t,{choose:e,urlOf:n,close:s,ways:o}){let r=e(t.title)??{text:t.id,tag:""},l=e(t.maker),a=e(t.date),c=[l,a].filter(m=>m!==null),u=e(t.text),f=e(t.image),p=e(t.link),d=h("h2",{tabIndex:-1,lang:r.tag,dir:"auto"},String(r.text));return i.replaceChildren(h("button",{className:"close",ariaLabel:"Close",onclick:s},"×"),d,...c.length?[h("p",{className:"by"},...X(c))]:[],...u?[h("div",{lang:u.tag,dir:"auto"},...w(u.text))]:[],...G(t,e,n),...f?[h("details",{},h("summary",{},"Description of the picture"),...I("p",f))]:[],...p&&M(p.text)?[h("p",{},h("a",{href:p.text,target:"_blank",rel:"noopener"},"More about it"))]:[],h("p",{className:"row"},...o.map(({text:m,go:b})=>h("button",{onclick:b},m)))),d}var X=i=>i.flatMap((t,e)=>[...e?[", "]:[],...I("span",t)]);function G(i,t,e){let n=t(i.sound),s=t(i.captions);if(!n)return[];let o=h("audio",{controls:!0,preload:"none",src:e(String(n.text))});if(!s)return[o];let r=h("track",{kind:"captions",default:!0,srclang:s.tag||"und"}),l=h("p",{className:"captions",lang:s.tag,dir:"auto"});return o.onplay=()=>{r.src||(r.src=e(String(s.text))),r.track.mode="hidden"},r.track.oncuechange=()=>{let a=[...r.track.activeCues??[]];l.textContent=a.map(c=>c.getCueAsHTML().textContent).join(`
`)},o.append(r),[o,l]}var L=(i="",t="")=>`#version 300 es
precision highp float;
uniform vec3 eye;
uniform mat3 turn;
uniform vec4 lens;
layout(location=0)in vec3 position;
layout(location=1)in vec2 place;
layout(location=2)in vec4 paint;
out vec3 seen;
out vec2 uv;
out vec3 painted;${i}
void main(){
${t}
painted=paint.rgb;
seen=turn*(position-eye);
uv=place;
gl_Position=vec4(seen.xy*lens.xy,seen.z*lens.z+lens.w,-seen.z);
}`,K=`
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
}`,W=`#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
in vec2 spot;
in vec3 painted;
uniform float cutoff;
uniform sampler2D lightmap;
uniform float lit;
out vec4 shown;
${K}
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
}`,z=`
vec2 bytes(float number) {
  float high = floor(number / 256.0);
  return vec2(number - 256.0 * high, high) / 255.0;
}`,J=`#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
uniform float item;
uniform vec2 size;
uniform float pixels;
out vec4 shown;
${z}
void main(){
float w=gl_FragCoord.w;
vec2 texels=uv*size;
vec2 across=(dFdx(texels*w)-texels*dFdx(w))/w;
vec2 up=(dFdy(texels*w)-texels*dFdy(w))/w;
float most=max(dot(across,across),dot(up,up));
float detail=0.5*log2(max(most,1e-30))-log2(pixels);
shown=vec4(bytes(item),bytes(floor(256.0*clamp(detail,0.0,31.0))));
}`,Z=`#version 300 es
precision highp float;
uniform float item;
layout(location=1)out vec4 shown;
${z}
void main(){shown=vec4(bytes(item),0.0,1.0);}`,$={surface:[L(`
layout(location = 3) in vec2 place2;
out vec2 spot;`,"spot = place2;"),W],item:[L(),J],placeholder:[L(),Z]};function U(i,t,e=$[t]){let n=i.createProgram(),s=[i.VERTEX_SHADER,i.FRAGMENT_SHADER];if(e.forEach((l,a)=>{let c=i.createShader(s[a]);i.shaderSource(c,l),i.compileShader(c),i.attachShader(n,c),i.deleteShader(c)}),i.linkProgram(n),!i.getProgramParameter(n,i.LINK_STATUS)&&!i.isContextLost())throw new Error(`${t}: ${i.getProgramInfoLog(n)}`);let o={},r=i.isContextLost()?0:i.getProgramParameter(n,i.ACTIVE_UNIFORMS);for(let l=0;l<r;l++){let a=i.getActiveUniform(n,l)?.name??"";o[a]=i.getUniformLocation(n,a)}return{program:n,at:o}}function q(i,{program:t,at:e},n){i.useProgram(t),i.uniform3fv(e.eye,n.eye),i.uniformMatrix3fv(e.turn,!1,n.turn),i.uniform4fv(e.lens,n.lens)}function T({eye:i,yaw:t,pitch:e},n,s,o){let[r,l,a,c]=[Math.sin(t),Math.cos(t),Math.sin(e),Math.cos(e)],u=[l,r*a,r*c,0,c,-a,-r,l*a,l*c],f=1/Math.tan(n/2),p=.1-o;return{eye:i,turn:u,lens:[f/s,f,(o+.1)/p,2*o*.1/p]}}var tt=15,et=24,nt=.03,D=.15,k=8,it=`#version 300 es
precision highp float;
uniform vec3 eye;
uniform mat3 turn;
uniform vec4 lens;
uniform vec3 point;
void main(){
vec3 seen=turn*(point-eye);
gl_Position=vec4(seen.xy*lens.xy,seen.z*lens.z+lens.w,-seen.z);
gl_PointSize=1.0;
}`,st=`#version 300 es
precision mediump float;
out vec4 shown;
void main() { shown = vec4(0.0); }`,S=class{#e=[];#n=[];#s=null;#i=null;#t=new Map;current=-1;constructor(t,e,{nameOf:n,open:s}){this.walk=t,this.labels=e,this.nameOf=n,this.open=s,this.root=h("div",{id:"markers"}),t.canvas.after(this.root),t.probe=o=>this.#a(o),t.turn(),t.canvas.addEventListener("webglcontextlost",()=>{this.#s=null,this.#n=[]})}get shown(){return[...this.#t.keys()]}#o(t){let e=new Set(this.walk.visible);return this.labels.map(({marker:n,cell:s},o)=>{let r=Math.hypot(...n.map((l,a)=>l-t[a]));return{label:o,away:s<0||e.has(s)?r:1/0}}).filter(({away:n})=>n<tt).sort((n,s)=>n.away-s.away).slice(0,et)}#a(t){let{gl:e}=this.walk;if(this.#r(),!this.#n.length){this.#s??=U(e,"markers",[it,st]),this.#i??=e.createVertexArray(),q(e,this.#s,t),e.bindVertexArray(this.#i),e.colorMask(!1,!1,!1,!1),e.depthMask(!1);for(let{label:n,away:s}of this.#o(t.eye)){let o=e.createQuery();if(!o)break;let r=Math.max(0,1-nt-D/Math.max(s,D)),l=this.labels[n].marker.map((a,c)=>t.eye[c]+(a-t.eye[c])*r);e.uniform3fv(this.#s.at.point,l),e.beginQuery(e.ANY_SAMPLES_PASSED_CONSERVATIVE,o),e.drawArrays(e.POINTS,0,1),e.endQuery(e.ANY_SAMPLES_PASSED_CONSERVATIVE),this.#n.push({label:n,query:o})}e.colorMask(!0,!0,!0,!0),e.depthMask(!0)}}#r(){let{gl:t}=this.walk,e=this.#n,n=e.at(-1);if(!(!n||!t.getQueryParameter(n.query,t.QUERY_RESULT_AVAILABLE))){this.#e=[];for(let{label:s,query:o}of e)this.#e[s]=!!t.getQueryParameter(o,t.QUERY_RESULT),t.deleteQuery(o);this.#n=[]}}place(t){let{walk:e}=this,{clientWidth:n,clientHeight:s}=e.canvas;this.#r();let{eye:o,turn:r,lens:l}=T(t,e.tall,e.aspect,e.far),a=new Map;for(let{label:c}of this.#o(o)){if(!this.#e[c])continue;let[u,f,p]=this.labels[c].marker.map((x,B)=>x-o[B]),d=[0,1,2].map(x=>r[x]*u+r[x+3]*f+r[x+6]*p);if(d[2]>=0)continue;let m=(.5-d[0]*l[0]/d[2]/2)*n,b=(.5+d[1]*l[1]/d[2]/2)*s;if(m<-k||b<-k||m>n+k||b>s+k)continue;let A=this.#t.get(c)??this.#l(c);A.style.transform=`translate(${m.toFixed(1)}px,${b.toFixed(1)}px)`,A.toggleAttribute("aria-current",c===this.current),a.set(c,A)}for(let[c,u]of this.#t)a.has(c)||(u===document.activeElement?a.set(c,u):u.remove());this.#t=a}#l(t){let e=this.nameOf(t),n=h("button",{title:e,ariaLabel:e});return n.onclick=()=>this.open(t),this.root.append(n),n}rename(){for(let[t,e]of this.#t)e.title=e.ariaLabel=this.nameOf(t)}rayAt(t,e,n){let{walk:s}=this,{clientWidth:o,clientHeight:r}=s.canvas,{eye:l,turn:a,lens:c}=T(t,s.tall,s.aspect,s.far),u=[(2*e/o-1)/c[0],(1-2*n/r)/c[1],-1],f=[0,1,2].map(p=>a[3*p]*u[0]+a[3*p+1]*u[1]+a[3*p+2]*u[2]);return{eye:l,ray:f}}renew(t){let{gl:e}=this.walk,n=new Map(this.labels.map((s,o)=>[V(s),this.#e[o]]));this.labels=t,this.#e=t.map(s=>n.get(V(s))??!1);for(let{query:s}of this.#n)e.deleteQuery(s);this.#n=[];for(let s of this.#t.values())s.remove();this.#t.clear(),this.walk.turn()}at(t,e,n){let{eye:s,ray:o}=this.rayAt(t,e,n),r=-1,l=1/0;for(let{label:a}of this.#o(s)){if(!this.#e[a])continue;let c=ot(s,o,this.labels[a].box);c<l&&([r,l]=[a,c])}return r}},V=({id:i,marker:t})=>`${i} ${t}`;function ot(i,t,e){let n=0,s=1/0;for(let o=0;o<3;o++){let r=(e[o]-i[o])/t[o],l=(e[o+3]-i[o])/t[o];n=Math.max(n,Math.min(r,l)||n),s=Math.min(s,Number.isNaN(Math.max(r,l))?s:Math.max(r,l))}return n<=s?n:1/0}var Q=`
#markers { position: fixed; inset: 0; pointer-events: none; overflow: hidden; }
#markers button { position: absolute; left: 0; top: 0; width: 44px; min-height: 44px; height: 44px; margin: -22px; padding: 0; border: 0; border-radius: 50%; background: none; pointer-events: auto; }
#markers button::before { content: ""; position: absolute; inset: 11px; border: 2px solid #16171b; border-radius: 50%; background: var(--ink); box-shadow: 0 0 0 2px #fffc, 0 2px 8px #000a; }
#markers button:hover::before, #markers button:focus-visible::before, #markers [aria-current]::before { background: var(--warm); inset: 8px; }
#markers button:focus-visible { outline-offset: -2px; }
#tour, #label { margin-left: auto; }
#tour ol { list-style: none; margin: 0; padding: 0; display: grid; gap: 6px; }
#tour li button { width: 100%; text-align: start; padding: 8px 12px; background: #ffffff0d; }
#tour li small { display: block; color: var(--dim); font-size: 13px; }
#tour [aria-current] { border-color: var(--warm); }
#tour select { width: 100%; margin: 0 0 10px; }
#label h2 { font-size: 20px; line-height: 1.25; margin: 0 44px 4px 0; }
#label h3 { color: inherit; font-size: 15px; }
#label .by { color: var(--dim); margin: 0 0 10px; }
#label p, #label li { max-width: 65ch; }
#label blockquote { margin: 8px 0; padding-inline-start: 12px; border-inline-start: 3px solid var(--line); }
#label audio { width: 100%; margin: 8px 0 0; }
#label .captions { min-height: 3em; margin: 6px 0 0; padding: 8px 10px; background: #000; border-radius: 8px; }
#label .captions:empty { display: none; }
#label .close { float: right; width: 44px; padding: 0; margin: -4px -6px 0 0; }
#label details summary { min-height: 32px; cursor: pointer; color: var(--dim); }
@media (forced-colors: active) { #markers button::before { border-color: CanvasText; forced-color-adjust: none; } }
`;var rt=6,at=500;async function lt(i,t){let e=new URL(t,document.baseURI).href;try{let n=await i.walk.fetcher.whole(e,s=>R(JSON.parse(new TextDecoder().decode(s))));return Y(),new E(i,n,e)}catch(n){let s=n instanceof g?n.code:"PTM-V105";return i.walk.faults.push({code:s,message:String(n)}),i.emit("notice",{message:"The labels of the tour could not be loaded."}),null}}var Y=()=>N(Q),E=class{open=-1;stop=-1;pick=null;#e=null;constructor(t,e,n){this.app=t,this.tour=e,this.url=n;let s=new URLSearchParams(location.search),o=s.get("lang");this.language=P(e.languages,[...o?[o]:[],...navigator.languages]),this.panel=h("section",{id:"label",ariaLabel:"Label",hidden:!0}),this.list=h("section",{id:"tour",ariaLabel:"Tour",tabIndex:0,hidden:!0}),y(document,"#panels").append(this.list,this.panel),this.button=h("button",{"aria-controls":"tour","aria-expanded":"false"},"Tour"),this.button.onclick=()=>this.#t(this.list.hidden),y(document,"nav").prepend(this.button),this.markers=new S(t.walk,e.labels,{nameOf:a=>this.nameOf(a),open:a=>this.show(a)}),this.#i(),this.#s();let r=e.labels.findIndex(({id:a})=>a===s.get("label")),l=s.get("stop")??"";r>=0?this.visit(r):/^\d+$/.test(l)&&Number(l)in e.stops&&this.go(Number(l))}choose=t=>C(t,this.language,this.tour.languages[0]);nameOf(t){let{id:e,title:n,maker:s}=this.tour.labels[t];return[this.choose(n)?.text??e,this.choose(s)?.text].filter(Boolean).join(", ")}#n(t){let{title:e,label:n}=this.tour.stops[t];return this.choose(e)?.text??(n===void 0?`Stop ${t+1}`:this.nameOf(n))}#s(){let{app:t}=this,{canvas:e}=t,n=()=>{t.walk.begun&&this.markers.place(t.walker.pose),requestAnimationFrame(n)};requestAnimationFrame(n);let s=null;e.addEventListener("pointerdown",o=>s=o.isPrimary?o:null),e.addEventListener("pointerup",o=>{if(!s||o.pointerId!==s.pointerId)return;let r=Math.hypot(o.clientX-s.clientX,o.clientY-s.clientY),l=o.timeStamp-s.timeStamp>at;if(s=null,r>rt||l)return;if(this.pick)return this.pick(o.clientX,o.clientY);let a=this.markers.at(t.walker.pose,o.clientX,o.clientY);a>=0&&this.show(a)}),addEventListener("keydown",({code:o,target:r,ctrlKey:l,altKey:a,metaKey:c})=>{l||a||c||r instanceof Element&&r.closest("input, select, textarea, audio")||(o==="KeyN"&&this.step(1),o==="KeyP"&&this.step(-1),o==="Escape"&&(this.panel.hidden?this.list.hidden||this.#t(!1):this.close()))})}#i(){let{languages:t,stops:e,title:n}=this.tour,s=this.choose(n),o=h("h2",{lang:s?.tag??"",dir:"auto"},s?.text??"Tour"),r=e.map((u,f)=>{let p=h("button",{dir:"auto",onclick:()=>this.go(f)},this.#n(f));return f===this.stop&&p.setAttribute("aria-current","true"),h("li",{},p)}),l=t.map(u=>h("option",{value:u,selected:u===this.language},ct(u))),a=h("select",{ariaLabel:"Language",onchange:()=>this.speak(a.value)},...l),{catalogue:c=""}=this.app.config;this.list.replaceChildren(o,...t.length>1?[a]:[],h("ol",{},...r),...c?[h("p",{},h("a",{href:c},"As a page of text and pictures"))]:[])}speak(t){this.speakQuietly(t),y(this.list,"select").focus()}speakQuietly(t){this.language=t,this.#i(),this.markers.rename(),this.open>=0&&this.show(this.open,!0)}#t(t){this.list.hidden=!t,this.button.setAttribute("aria-expanded",String(t)),!t&&this.list.contains(document.activeElement)&&this.button.focus()}renew(t){this.tour=t,this.markers.renew(t.labels),t.languages.includes(this.language)||(this.language=t.languages[0]),this.stop in t.stops||(this.stop=-1),this.#i(),this.open in t.labels?this.show(this.open,!0):this.panel.hidden||this.close()}show(t,e=!1){let{panel:n,tour:s}=this,o=document.activeElement;n.hidden&&(this.#e=o instanceof HTMLElement?o:null),this.open=this.markers.current=t,n.hidden=!1,matchMedia("(max-width: 640px)").matches&&this.#t(!1);let r=s.stops.length>1?[{text:"Previous",go:()=>this.step(-1)},{text:"Next",go:()=>this.step(1)}]:[],l=_(n,s.labels[t],{choose:this.choose,urlOf:a=>new URL(a,this.url).href,close:()=>this.close(),ways:r});e||(l.focus({preventScroll:!0}),n.scrollTop=0,this.app.emit("label",s.labels[t].id))}close(){let{panel:t}=this,e=t.contains(document.activeElement);t.hidden=!0,t.replaceChildren(),this.open=this.markers.current=-1;let n=this.#e?.isConnected?this.#e:this.app.canvas;e&&n.focus()}visit(t){let e=this.tour.stops.findIndex(n=>n.label===t);e>=0?this.go(e):this.show(t)}step(t){let{length:e}=this.tour.stops;e&&this.go((Math.max(this.stop,t>0?-1:0)+t+e)%e)}go(t){let{app:e,tour:n}=this,{position:s,direction:[o,r,l],label:a}=n.stops[t],c=Math.asin(Math.max(-1,Math.min(1,r/Math.hypot(o,r,l))));this.stop=t,e.follow({eye:[...s],yaw:Math.atan2(-o,-l),pitch:c}),O()||e.canvas.animate([{opacity:0},{opacity:1}],250),this.#i(),a!==void 0?this.show(a):this.panel.hidden||this.close()}};function ct(i){try{return new Intl.DisplayNames([i],{type:"language"}).of(i)??i}catch{return i}}export{E as Tour,Y as addTourStyle,lt as attachTour};
