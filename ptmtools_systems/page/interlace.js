var N=(s="",e="")=>`#version 300 es
precision highp float;
uniform vec3 eye;
uniform mat3 turn;
uniform vec4 lens;
layout(location=0)in vec3 position;
layout(location=1)in vec2 place;
layout(location=2)in vec4 paint;
out vec3 seen;
out vec2 uv;
out vec3 painted;${s}
void main(){
${e}
painted=paint.rgb;
seen=turn*(position-eye);
uv=place;
gl_Position=vec4(seen.xy*lens.xy,seen.z*lens.z+lens.w,-seen.z);
}`,de=`
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
}`,ue=`#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
in vec2 spot;
in vec3 painted;
uniform float cutoff;
uniform sampler2D lightmap;
uniform float lit;
out vec4 shown;
${de}
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
}`,G=`
vec2 bytes(float number) {
  float high = floor(number / 256.0);
  return vec2(number - 256.0 * high, high) / 255.0;
}`,me=`#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
uniform float item;
uniform vec2 size;
uniform float pixels;
out vec4 shown;
${G}
void main(){
float w=gl_FragCoord.w;
vec2 texels=uv*size;
vec2 across=(dFdx(texels*w)-texels*dFdx(w))/w;
vec2 up=(dFdy(texels*w)-texels*dFdy(w))/w;
float most=max(dot(across,across),dot(up,up));
float detail=0.5*log2(max(most,1e-30))-log2(pixels);
shown=vec4(bytes(item),bytes(floor(256.0*clamp(detail,0.0,31.0))));
}`,pe=`#version 300 es
precision highp float;
uniform float item;
layout(location=1)out vec4 shown;
${G}
void main(){shown=vec4(bytes(item),0.0,1.0);}`,W={surface:[N(`
layout(location = 3) in vec2 place2;
out vec2 spot;`,"spot = place2;"),ue],item:[N(),me],placeholder:[N(),pe]};function _(s,e,t=W[e]){let o=s.createProgram(),r=[s.VERTEX_SHADER,s.FRAGMENT_SHADER];if(t.forEach((a,n)=>{let h=s.createShader(r[n]);s.shaderSource(h,a),s.compileShader(h),s.attachShader(o,h),s.deleteShader(h)}),s.linkProgram(o),!s.getProgramParameter(o,s.LINK_STATUS)&&!s.isContextLost())throw new Error(`${e}: ${s.getProgramInfoLog(o)}`);let i={},c=s.isContextLost()?0:s.getProgramParameter(o,s.ACTIVE_UNIFORMS);for(let a=0;a<c;a++){let n=s.getActiveUniform(o,a)?.name??"";i[n]=s.getUniformLocation(o,n)}return{program:o,at:i}}function u(s,e){let t=s.querySelector(e);if(!t)throw new Error(`the page has no ${e}`);return t}function H(s,e={},...t){let o=document.createElement(s);for(let[r,i]of Object.entries(e))r in o?Reflect.set(o,r,i):o.setAttribute(r,i);return o.append(...t),o}function O(s){let e=s<1e6?["kB",1e3]:["MB",1e6],t=s/Number(e[1]);return`${t.toFixed(t<10?1:0)} ${e[0]}`}function K(s){let e={antialias:!0,failIfMajorPerformanceCaveat:!0},t={antialias:!1};return s.getContext("webgl2",e)??s.getContext("webgl2",t)}var d=class extends Error{constructor(e,t){super(t),this.code=e}};var C=(s,e)=>Object.assign(e,Reflect.get(globalThis,"ptmWords")?.[s]);var p=C("page",{room:"Loading the room",textures:"Loading textures",outside:"The link leads to a place outside of the building.",unloaded:"A part of this page cannot be loaded now.",copied:"The link to this place is copied.",slow:"Textures load slowly here: the server does not support range requests.",noSimd:"This browser cannot run WebAssembly with SIMD.",noWebgl:"This browser cannot draw with WebGL 2.",damaged:"{file} is damaged: {reason}",offline:"{file} cannot be downloaded: {reason}",missing:"{file} is missing on this site",refused:"{file} is refused with status {reason} on this site",unshown:"{file} is not shown: {reason}",partial:"{file} is not shown with all of its levels: {reason}",undecoded:"Textures cannot be decoded: {reason}",noGeometry:"The geometry cannot be decoded: {reason}","PTM-V101":"Use a current Chrome, Edge or Firefox, or Safari 16.4 or newer, with hardware acceleration on.","PTM-V102":"Use a current Chrome, Edge or Firefox, or Safari 16.4 or newer.","PTM-V103":"Tell the owner of this site: publishing it again should repair it.","PTM-V104":"Check your connection and reload the page.","PTM-V105":"Tell the owner of this site: publishing it again should repair it.","PTM-V106":"Update the browser, or allow this page to use web workers and more memory.",otherwise:"Reload the page. If that does not help, tell the owner of this site."});var P=C("objects",{relief:"The relief of {name} does not fit the index.",object:"an object",octree:"The index has a wrong octree: {reason}",largeTexture:"This graphics card has no textures of 4,096 texels.",largeImage:"The image is larger than this graphics card's textures.",damaged:"{file} is damaged: {reason}",noSets:"This site has no interlaced images, so you see its own textures.",fixed:"The policy and the comparison are those of other textures than interlaced images."}),v=C("form",{reset:"The graphics card has reset the page.",orbit:"Drag or use the arrow keys to turn; wheel, two fingers, + and − to zoom",pan:"Drag or use the arrow keys to move; wheel, two fingers, + and − to zoom",campus:"WASD or the arrow keys to walk, drag to look around, Shift to run",levels:"{count} of {total} levels, {bytes} of {all}",files:"{count} of {total} files, {size} of {whole}, {bytes} of {all}",closer:"finer ones when you come closer",zoom:"finer ones when you zoom in",tooLarge:"more than this graphics card can hold",eightBits:"shown in 8 bits",loading:"loading",near:"{count} of {total} near objects complete",memory:"{bytes} received, {all} of graphics memory",places:"Places",detail:"Detail of near objects",record:"Record",close:"Close"});var we="de fr es it zh ja",k=Promise.resolve(),Y=(s={page:p})=>k=ge(s);async function ge(s){let t=[new URLSearchParams(location.search).get("lang")??"",...navigator.languages].map(i=>i.toLowerCase().split("-")[0]).find(i=>`en ${we}`.split(" ").includes(i))??"en";if(t==="en")return;let o=`./words-${t}.js`,r=await import(o).catch(()=>null);for(let i in s)Object.assign(s[i],r?.words[i])}var A=(s,e)=>s.replace(/\{(\w+)\}/g,(t,o)=>e[o]);var xe=6,Ee=.5,j=20,b=class extends Error{constructor(e,t=!1){super(e),this.anew=t}},y=()=>performance.now()/1e3,L=class{constructor(e){this.notice=e,this.measured=null,this.requests=0,this.bytes=0,this.pending=0,this.ignoresRanges=!1}whole(e,t,o,r="default"){return this.#t(e,r,o,async i=>{let{response:c,body:a}=await this.#s(e,{cache:i},o);if(c.status!==200)throw await q(e,c.status);try{return await t(a)}catch(n){if(n instanceof d)throw n;let h=n.message;throw i==="default"?new b(h,!0):new d("PTM-V105",A(p.damaged,{file:$(e),reason:h}))}})}range(e,t,o,r,i,c="default"){let a=`bytes=${t}-${o-1}`;return this.#t(e,c,i,async n=>{let{response:h,body:f}=await this.#s(e,{cache:n,headers:{range:a}},i);if(h.status===200){if(f.length!==r)throw new b(`${f.length} of ${r} bytes`,!0);return this.#e(),{begin:0,body:f}}if(h.status!==206)throw await q(e,h.status);let l=h.headers.get("content-range")??`bytes ${t}-${o-1}/${r}`;if(l!==`bytes ${t}-${o-1}/${r}`||f.length!==o-t)throw new b(`${f.length} bytes, "${l}", in place of ${a}`,!0);return{begin:t,body:f}})}#e(){this.ignoresRanges||(this.ignoresRanges=!0,console.warn("This host ignores byte ranges: each texture is downloaded whole before it is seen."),this.notice(p.slow))}async#t(e,t,o,r){let i=o?.left??0,c="";for(let a=0;a<xe;a++){a&&(o&&Object.assign(o,{left:0,waits:!0}),await ye(Ee*2**(a-1))),o&&Object.assign(o,{left:i,waits:!1}),this.pending++;try{return await r(t)}catch(n){if(n instanceof d)throw n;n instanceof b&&n.anew&&(t="no-store"),c=String(n.message)}finally{this.pending--}}throw await k,new d("PTM-V104",A(p.offline,{file:$(e),reason:c}))}async#s(e,t,o){this.requests++;let r=new AbortController,i=new b(`nothing came for ${j} s`),c=setTimeout(()=>r.abort(i),1e3*j);try{let a=y(),n=await fetch(e,{...t,signal:r.signal}),h=y(),f=n.body?.getReader(),l=[];for(;;){let{done:m,value:g}=await f?.read()??{done:!0,value:void 0};if(m||!g){let T=Te(l);return this.measured?.(a,h,y(),T.length),{response:n,body:T}}clearTimeout(c),c=setTimeout(()=>r.abort(i),1e3*j),l.push(g),this.bytes+=g.length,o&&(o.left-=g.length)}}finally{clearTimeout(c)}}};function Te(s){let e=new Uint8Array(s.reduce((o,{length:r})=>o+r,0)),t=0;for(let o of s)e.set(o,t),t+=o.length;return e}async function q(s,e){if(e>=500||e===429||e===408)return new b(`status ${e}`);await k;let t=e===404?p.missing:p.refused;return new d("PTM-V103",A(t,{file:$(s),reason:e}))}function $(s){return decodeURIComponent(new URL(s,location.href).pathname.split("/").pop()??s)}function ye(s){return new Promise(e=>{let t=()=>{clearTimeout(o),removeEventListener("online",t),e(void 0)},o=setTimeout(t,1e3*s);addEventListener("online",t)})}var J=8e3,ve=["nav","#panels","#view"];function Z(s,{code:e,message:t}){let o=u(s,"#error"),r=u(s,"#again");u(s,"#error-text").textContent=t,u(s,"#error-remedy").textContent=p[e]??p.otherwise,u(s,"#error-code").textContent=e,u(s,"#loading").hidden=!0,o.hidden=!1;for(let i of ve)u(s,i).inert=!0;r.onclick=()=>location.reload(),r.focus()}function Q(s,...e){let t=H("p",{},...e);u(s,"#notices").append(t);let o=()=>{t.contains(s.activeElement)?setTimeout(o,J):t.remove()};setTimeout(o,J)}var be=s=>Math.round(s*1e5)/1e5,D=class{#e=[];#t=y();constructor(e,t){this.canvas=e,this.look=t}frame(){let{eye:e,direction:t}=this.look(),r=[this.#e.length?y()-this.#t:0,...Array.from(e),...Array.from(t)].map(be);(!this.#e.length||r[0]>this.#e[this.#e.length-1][0])&&this.#e.push(r)}get document(){let{canvas:{width:e,height:t}}=this;return{format:"ptmtools walk",schema:1,fieldOfView:this.look().angle,aspect:e/t,samples:this.#e}}};var Re=15,Ae=5;async function ee(s){let e=!1,t=!1,o=r=>{e=!0;let i=r instanceof d;Z(document,i?r:new d("PTM-V107",String(r)))};try{await Y({page:p,form:v,objects:P});let r=u(document,"canvas"),i=JSON.parse(u(document,"#site").textContent??""),c=K(r);if(!c)throw new d("PTM-V101",p.noWebgl);let a=null,n=y();r.addEventListener("webglcontextlost",x=>{x.preventDefault(),t=!0;let E=()=>o(new d("PTM-V107",v.reset));y()-n<Ae?E():setTimeout(E,1e3*Re)}),r.addEventListener("webglcontextrestored",()=>{e||(a?.address&&history.replaceState(null,"",a.address()),location.reload())});let h=new L(x=>Q(document,x));a=await s(c,i,h,x=>{t||o(x)});let f=a,{look:l}=a,m=null;l&&Object.defineProperties(a,{record:{value:()=>m=new D(r,l)},recording:{get:()=>m?.document??null}}),Object.assign(window,{ptm:a});let g=u(document,"#status"),T=y(),R=()=>{if(e||t)return;let x=y();try{Se(r);let E=f.frame(Math.min(x-T,.1));m?.frame(),g.textContent!==E&&(g.textContent=E)}catch(E){throw o(E),E}T=x,requestAnimationFrame(R)};requestAnimationFrame(R),document.body.classList.add("begun"),addEventListener("keydown",()=>document.body.classList.add("keys"),{once:!0})}catch(r){o(r)}}function Se(s){let e=Math.max(1,Math.round(s.clientWidth*devicePixelRatio)),t=Math.max(1,Math.round(s.clientHeight*devicePixelRatio));(s.width!==e||s.height!==t)&&Object.assign(s,{width:e,height:t})}function te(s,e,t){return s.whole(e,o=>t(JSON.parse(new TextDecoder("utf-8",{fatal:!0}).decode(o))))}var Me=Uint32Array.from({length:256},(s,e)=>{for(let t=0;t<8;t++)e=e&1?e>>>1^3988292384:e>>>1;return e});function B(s,e=0){let t=~e;for(let o=0;o<s.length;o++)t=Me[(t^s[o])&255]^t>>>8;return~t>>>0}var xt=2**24;var Et=new Uint8Array([3,0]);function w(s,e){if(!s)throw new Error(e)}var U=(s,e,t)=>Number.isInteger(s)&&e<=s&&s<=t;var se={png:"image/png",jpg:"image/jpeg",webp:"image/webp"},Pe=65536,Ue=2**30;function oe(s){w(s?.format==="ptmtools interlaced image"&&s.schema===1,"not an index of an interlaced image");let{width:e,height:t,container:o,files:r,kind:i,original:c}=s,a=h=>U(h,1,Pe);w(a(e)&&a(t)&&a(c?.width)&&a(c?.height),"no size"),w(o in se&&(i==="uint8"||i==="uint16"),"another container"),w(Array.isArray(r)&&U(r.length,1,33),"no files");let n={width:0,height:0};return r.forEach((h,f)=>{let{axis:l,joined:m}=h;w(h.name===`${f+1}.${o}`,"a file of another name"),w(a(h.width)&&a(h.height),"a file without size"),w(U(h.bytes,1,9*h.width*h.height+2**20),"a file of too many bytes"),w(U(h.crc32,0,4294967295)&&(f?l==="columns"||l==="rows":l===null),"no axis");let[g,T]=f?l==="columns"?[2,1]:[1,2]:[1,1];f||(n={width:h.width,height:h.height}),w(h.width===n.width&&h.height===n.height,"a file of another size"),n={width:g*n.width,height:T*n.height},w(m?.width===n.width&&m?.height===n.height,"a step of another size")}),w(n.width===e&&n.height===t,"steps that do not make the image"),s}var _e=`#version 300 es
void main(){
gl_Position=vec4(4*(gl_VertexID & 1)-1,4*(gl_VertexID >> 1)-1,0,1);
}`,ke=`#version 300 es
precision highp float;
precision highp sampler2D;
uniform sampler2D before,next,pattern;
uniform vec2 size;
uniform bool pairs;
out vec4 texel;
void main(){
vec2 place=gl_FragCoord.xy/size;
vec4 added=texture(next,place);
if(pairs)added=added.rarr;
texel=texture(pattern,place*size/2.0).r==0.0?texture(before,place):added;
}`,Le={columns:[0,255,0,255],rows:[0,0,255,255],first:[255,255,255,255]};async function De(s,e){if(!e)return createImageBitmap(s,{colorSpaceConversion:"none"});let t=URL.createObjectURL(s),o=Object.assign(new Image,{src:t});return await o.decode().finally(()=>URL.revokeObjectURL(t)),o}function Ie(s,{container:e},{bytes:t,crc32:o}){return w(s.length===t&&B(s)===o,"another checksum"),new Blob([s],{type:se[e]})}async function Fe(s,{components:e},{width:t,height:o}){let r=await De(s,e%2===0);return w(r.width===t&&r.height===o,"an image of another size"),r}var X=class{constructor(e){this.gl=e,this.use=_(e,"join",[_e,ke]),this.buffer=e.createFramebuffer(),this.patterns=Object.fromEntries(Object.entries(Le).map(([t,o])=>{let r=this.#e(2,2,e.R8);for(let i of[e.TEXTURE_WRAP_S,e.TEXTURE_WRAP_T])e.texParameteri(e.TEXTURE_2D,i,e.REPEAT);return e.pixelStorei(e.UNPACK_ALIGNMENT,1),e.texSubImage2D(e.TEXTURE_2D,0,0,0,2,2,e.RED,e.UNSIGNED_BYTE,new Uint8Array(o)),[t,r]}))}upload(e){let{gl:t}=this,o=this.#e(e.width,e.height,t.RGBA8);return t.pixelStorei(t.UNPACK_PREMULTIPLY_ALPHA_WEBGL,!1),t.pixelStorei(t.UNPACK_COLORSPACE_CONVERSION_WEBGL,t.NONE),t.texSubImage2D(t.TEXTURE_2D,0,0,0,t.RGBA,t.UNSIGNED_BYTE,e),"close"in e&&e.close(),o}join({axis:e,joined:{width:t,height:o}},r,i,c=4,a=!1){let{gl:n,use:{program:h,at:f}}=this,l=a?1+Math.floor(Math.log2(Math.max(t,o))):1,m=this.#e(t,o,c===1?n.R8:c===2?n.RG8:n.RGBA8,l);n.bindFramebuffer(n.FRAMEBUFFER,this.buffer),n.framebufferTexture2D(n.FRAMEBUFFER,n.COLOR_ATTACHMENT0,n.TEXTURE_2D,m,0),n.viewport(0,0,t,o),n.disable(n.BLEND),n.useProgram(h);let g={before:r??i,next:i,pattern:this.patterns[e??"first"]};return Object.entries(g).forEach(([T,R],x)=>{n.activeTexture(n.TEXTURE0+x),n.bindTexture(n.TEXTURE_2D,R),R===r&&this.#t(n.NEAREST,n.NEAREST),n.uniform1i(f[T],x)}),n.activeTexture(n.TEXTURE0),n.uniform2f(f.size,t,o),n.uniform1i(f.pairs,+(c===2)),n.drawArrays(n.TRIANGLES,0,3),n.bindFramebuffer(n.FRAMEBUFFER,null),n.deleteTexture(r),n.deleteTexture(i),a&&(n.bindTexture(n.TEXTURE_2D,m),n.generateMipmap(n.TEXTURE_2D),this.#t(n.LINEAR_MIPMAP_LINEAR,n.LINEAR)),m}texels(e,t,o){let{gl:r}=this,i=new Uint8Array(4*t*o);return r.bindFramebuffer(r.FRAMEBUFFER,this.buffer),r.framebufferTexture2D(r.FRAMEBUFFER,r.COLOR_ATTACHMENT0,r.TEXTURE_2D,e,0),r.readPixels(0,0,t,o,r.RGBA,r.UNSIGNED_BYTE,i),r.bindFramebuffer(r.FRAMEBUFFER,null),i}#e(e,t,o,r=1){let{gl:i}=this,c=i.createTexture();i.bindTexture(i.TEXTURE_2D,c),i.texStorage2D(i.TEXTURE_2D,r,o,e,t),this.#t(i.NEAREST,i.NEAREST);for(let a of[i.TEXTURE_WRAP_S,i.TEXTURE_WRAP_T])i.texParameteri(i.TEXTURE_2D,a,i.CLAMP_TO_EDGE);return c}#t(e,t){this.gl.texParameteri(this.gl.TEXTURE_2D,this.gl.TEXTURE_MIN_FILTER,e),this.gl.texParameteri(this.gl.TEXTURE_2D,this.gl.TEXTURE_MAG_FILTER,t)}};function Ne(s,{files:e}){let t=s.getParameter(s.MAX_TEXTURE_SIZE),o=e.findIndex(({joined:{width:r,height:i}})=>Math.max(r,i)>t||4*r*i>Ue);return o<0?e.length:o}var I=class{constructor(e,t,o,r){if(this.index=t,this.urlOf=o,this.fetcher=r,this.joiner=new X(e),this.texture=null,this.steps=0,this.running=!1,this.most=Ne(e,t),!this.most)throw new d("PTM-V101",P.largeImage)}get size(){return this.steps?this.index.files[this.steps-1].joined:{width:0,height:0}}advance(e){this.running||this.steps===this.most||(this.running=!0,this.#e().then(()=>this.running=!1,e))}async#e(){let{index:e,joiner:t}=this,o=e.files[this.steps],r=await this.fetcher.whole(this.urlOf(o.name),c=>Fe(Ie(c,e,o),e,o)),i=t.upload(r);this.texture=o.axis?t.join(o,this.texture,i):i,this.steps++}texels(){let{width:e,height:t}=this.size;return this.joiner.texels(this.texture,e,t)}};var re={ArrowLeft:[1,0,0],ArrowRight:[-1,0,0],ArrowUp:[0,1,0],ArrowDown:[0,-1,0],Equal:[0,0,1],NumpadAdd:[0,0,1],Minus:[0,0,-1],NumpadSubtract:[0,0,-1]},F=class{#e=new Set;#t=new Map;constructor(e,t,o){this.canvas=e,this.width=t,this.height=o,this.scale=0,this.shift=[0,0],e.focus({preventScroll:!0}),e.addEventListener("pointerdown",r=>{r.button===0&&(e.setPointerCapture(r.pointerId),this.#t.set(r.pointerId,this.#r(r)))});for(let r of["pointerup","pointercancel"])e.addEventListener(r,i=>this.#t.delete(i.pointerId));e.addEventListener("pointermove",r=>this.#a(r)),e.addEventListener("wheel",r=>{r.preventDefault(),this.#o(Math.exp(-r.deltaY*.0015),this.#r(r))},{passive:!1}),e.addEventListener("keydown",r=>{if(r.ctrlKey||r.metaKey||r.altKey)return this.#e.clear();r.code in re&&(r.preventDefault(),this.#e.add(r.code))}),e.addEventListener("keyup",r=>this.#e.delete(r.code)),e.addEventListener("blur",()=>this.#e.clear())}get#s(){return Math.min(this.canvas.width/this.width,this.canvas.height/this.height)}get pixels(){return this.scale||this.#s}place(e,t=[0,0]){this.scale=e>0?this.#i(e):0;let o=[this.width,this.height].map(i=>i*this.pixels),r=[this.canvas.width,this.canvas.height];this.shift=t.map((i,c)=>Math.max(-1,Math.min(1,2*i/(o[c]+.8*r[c])))*(o[c]+.8*r[c])/2)}step(e){for(let t of this.#e){let[o,r,i]=re[t];i?this.#o(Math.exp(i*1.2*e),[0,0]):this.place(this.scale,[this.shift[0]+o*600*e,this.shift[1]+r*600*e])}}get box(){let{width:e,height:t}=this.canvas,{pixels:o,shift:[r,i]}=this,[c,a]=[this.width*o/e,this.height*o/t],[n,h]=[2*r/e,2*i/t];return[n-c,-h-a,n+c,-h+a]}#i(e){let t=this.#s;return Math.max(.25*Math.min(1,t),Math.min(Math.max(32,2*t),e))}#o(e,t){let o=this.pixels,r=this.#i(o*e);this.place(r,this.shift.map((i,c)=>t[c]+(i-t[c])*(r/o)))}#r({offsetX:e,offsetY:t}){let o=this.canvas.width/Math.max(1,this.canvas.clientWidth);return[e*o-this.canvas.width/2,t*o-this.canvas.height/2]}#a(e){if(!this.#t.get(e.pointerId))return;let{spread:o,middle:r}=this.#n();this.#t.set(e.pointerId,this.#r(e));let i=this.#n();this.place(this.scale,this.shift.map((c,a)=>c+i.middle[a]-r[a])),o>0&&i.spread>0&&this.#o(i.spread/o,i.middle)}#n(){let e=[...this.#t.values()],[t,o]=e;return{middle:[0,1].map(i=>e.reduce((c,a)=>c+a[i],0)/e.length),spread:o?Math.hypot(t[0]-o[0],t[1]-o[1]):0}}};var Oe=`#version 300 es
uniform vec4 box;
out vec2 place;
void main(){
vec2 corner=vec2(gl_VertexID & 1,gl_VertexID >> 1);
place=vec2(corner.x,1.0-corner.y);
gl_Position=vec4(mix(box.xy,box.zw,corner),0,1);
}`,Ce=`#version 300 es
precision highp float;
uniform sampler2D image;
in vec2 place;
out vec4 shown;
void main(){
vec2 size=vec2(textureSize(image,0));
vec2 step=vec2(dFdx(place.x),dFdy(place.y));
vec2 each=clamp(ceil(abs(step)*size),1.0,8.0);
vec4 sum=vec4(0);
for(float y=0.5; y < each.y; y++)
for(float x=0.5; x < each.x; x++){
vec4 texel=texture(image,place+(vec2(x,y)/each-0.5)*step);
sum+=vec4(texel.rgb*texel.a,texel.a);
}
sum/=each.x*each.y;
shown=vec4(sum.rgb+(1.0-sum.a)*vec3(0.227,0.243,0.275),1);
}`;ee(async(s,e,t,o)=>{let r=new URL(e.index,location.href).href,i=M=>new URL(M,r).href,c=await te(t,r,oe),a=new I(s,c,i,t),{width:n,height:h}=c.original,f=s.canvas,l=new F(f,n,h),m=new URLSearchParams(location.search).has("all"),{program:g,at:T}=_(s,"picture",[Oe,Ce]),R=s.createVertexArray(),x=c.files.reduce((M,{bytes:S})=>M+S,0);u(document,"#keys").textContent=v.pan;let E=!0,z="",ie=()=>{s.viewport(0,0,s.drawingBufferWidth,s.drawingBufferHeight),s.clearColor(.086,.09,.106,1),s.clear(s.COLOR_BUFFER_BIT),a.texture&&(s.useProgram(g),s.bindVertexArray(R),s.activeTexture(s.TEXTURE0),s.bindTexture(s.TEXTURE_2D,a.texture),s.uniform1i(T.image,0),s.uniform4fv(T.box,l.box),s.drawArrays(s.TRIANGLE_STRIP,0,4))};return{frame(M){l.step(M);let{size:S}=a;E=m||!a.steps||S.width<l.pixels*n||S.height<l.pixels*h,E&&a.advance(o);let V=[f.width,f.height,...l.box,a.steps].join();V!==z&&ie(),z=V;let ne=c.files.slice(0,a.steps).reduce((le,{bytes:fe})=>le+fe,0),ae=a.steps===c.files.length?"":a.steps===a.most?`; ${v.tooLarge}`:E?" …":`; ${v.zoom}`,ce=A(v.files,{count:a.steps,total:c.files.length,size:`${S.width} × ${S.height}`,whole:`${c.width} × ${c.height}`,bytes:O(ne),all:O(x)}),he=c.kind==="uint16"?`; ${v.eightBits}`:"";return`${ce}${ae}${he}`},state:()=>({steps:a.steps,size:a.size,pixels:l.pixels,shift:l.shift,complete:a.steps===a.most,needed:E,pending:t.pending,requests:t.requests,bytes:t.bytes}),texels:()=>a.texels(),place:l.place.bind(l)}});
