var P=(i="",e="")=>`#version 300 es
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
${e}
painted=paint.rgb;
seen=turn*(position-eye);
uv=place;
gl_Position=vec4(seen.xy*lens.xy,seen.z*lens.z+lens.w,-seen.z);
}`,re=`
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
}`,oe=`#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
in vec2 spot;
in vec3 painted;
uniform float cutoff;
uniform sampler2D lightmap;
uniform float lit;
out vec4 shown;
${re}
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
}`,C=`
vec2 bytes(float number) {
  float high = floor(number / 256.0);
  return vec2(number - 256.0 * high, high) / 255.0;
}`,ae=`#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
uniform float item;
uniform vec2 size;
uniform float pixels;
out vec4 shown;
${C}
void main(){
float w=gl_FragCoord.w;
vec2 texels=uv*size;
vec2 across=(dFdx(texels*w)-texels*dFdx(w))/w;
vec2 up=(dFdy(texels*w)-texels*dFdy(w))/w;
float most=max(dot(across,across),dot(up,up));
float detail=0.5*log2(max(most,1e-30))-log2(pixels);
shown=vec4(bytes(item),bytes(floor(256.0*clamp(detail,0.0,31.0))));
}`,he=`#version 300 es
precision highp float;
uniform float item;
layout(location=1)out vec4 shown;
${C}
void main(){shown=vec4(bytes(item),0.0,1.0);}`,X={surface:[P(`
layout(location = 3) in vec2 place2;
out vec2 spot;`,"spot = place2;"),oe],item:[P(),ae],placeholder:[P(),he]};function M(i,e,t=X[e]){let s=i.createProgram(),n=[i.VERTEX_SHADER,i.FRAGMENT_SHADER];if(t.forEach((a,o)=>{let c=i.createShader(n[o]);i.shaderSource(c,a),i.compileShader(c),i.attachShader(s,c),i.deleteShader(c)}),i.linkProgram(s),!i.getProgramParameter(s,i.LINK_STATUS)&&!i.isContextLost())throw new Error(`${e}: ${i.getProgramInfoLog(s)}`);let r={},h=i.isContextLost()?0:i.getProgramParameter(s,i.ACTIVE_UNIFORMS);for(let a=0;a<h;a++){let o=i.getActiveUniform(s,a)?.name??"";r[o]=i.getUniformLocation(s,o)}return{program:s,at:r}}function m(i,e){let t=i.querySelector(e);if(!t)throw new Error(`the page has no ${e}`);return t}function B(i,e={},...t){let s=document.createElement(i);for(let[n,r]of Object.entries(e))n in s?Reflect.set(s,n,r):s.setAttribute(n,r);return s.append(...t),s}function I(i){let e=i<1e6?["kB",1e3]:["MB",1e6],t=i/Number(e[1]);return`${t.toFixed(t<10?1:0)} ${e[0]}`}var u=class extends Error{constructor(e,t){super(t),this.code=e}};var ce=6,le=.5,L=20,T=class extends Error{constructor(e,t=!1){super(e),this.anew=t}},g=()=>performance.now()/1e3,S=class{constructor(e){this.notice=e,this.measured=null,this.requests=0,this.bytes=0,this.pending=0,this.ignoresRanges=!1}whole(e,t,s,n="default"){return this.#t(e,n,s,async r=>{let{response:h,body:a}=await this.#s(e,{cache:r},s);if(h.status!==200)throw z(e,h.status);try{return await t(a)}catch(o){if(o instanceof u)throw o;let c=o.message;throw r==="default"?new T(c,!0):new u("PTM-V105",`${D(e)} is damaged: ${c}`)}})}range(e,t,s,n,r,h="default"){let a=`bytes=${t}-${s-1}`;return this.#t(e,h,r,async o=>{let{response:c,body:l}=await this.#s(e,{cache:o,headers:{range:a}},r);if(c.status===200){if(l.length!==n)throw new T(`${l.length} of ${n} bytes`,!0);return this.#e(),{begin:0,body:l}}if(c.status!==206)throw z(e,c.status);let f=c.headers.get("content-range")??`bytes ${t}-${s-1}/${n}`;if(f!==`bytes ${t}-${s-1}/${n}`||l.length!==s-t)throw new T(`${l.length} bytes, "${f}", in place of ${a}`,!0);return{begin:t,body:l}})}#e(){this.ignoresRanges||(this.ignoresRanges=!0,console.warn("This host ignores byte ranges: each texture is downloaded whole before it is seen."),this.notice("Textures load slowly here: the server does not support range requests."))}async#t(e,t,s,n){let r=s?.left??0,h="";for(let a=0;a<ce;a++){a&&(s&&Object.assign(s,{left:0,waits:!0}),await de(le*2**(a-1))),s&&Object.assign(s,{left:r,waits:!1}),this.pending++;try{return await n(t)}catch(o){if(o instanceof u)throw o;o instanceof T&&o.anew&&(t="no-store"),h=String(o.message)}finally{this.pending--}}throw new u("PTM-V104",`${D(e)} cannot be downloaded: ${h}`)}async#s(e,t,s){this.requests++;let n=new AbortController,r=new T(`nothing came for ${L} s`),h=setTimeout(()=>n.abort(r),1e3*L);try{let a=g(),o=await fetch(e,{...t,signal:n.signal}),c=g(),l=o.body?.getReader(),f=[];for(;;){let{done:w,value:x}=await l?.read()??{done:!0,value:void 0};if(w||!x){let d=fe(f);return this.measured?.(a,c,g(),d.length),{response:o,body:d}}clearTimeout(h),h=setTimeout(()=>n.abort(r),1e3*L),f.push(x),this.bytes+=x.length,s&&(s.left-=x.length)}}finally{clearTimeout(h)}}};function fe(i){let e=new Uint8Array(i.reduce((s,{length:n})=>s+n,0)),t=0;for(let s of i)e.set(s,t),t+=s.length;return e}function z(i,e){if(e>=500||e===429||e===408)return new T(`status ${e}`);let t=e===404?"is missing":`is refused with status ${e}`;return new u("PTM-V103",`${D(i)} ${t} on this site`)}function D(i){return decodeURIComponent(new URL(i,location.href).pathname.split("/").pop()??i)}function de(i){return new Promise(e=>{let t=()=>{clearTimeout(s),removeEventListener("online",t),e(void 0)},s=setTimeout(t,1e3*i);addEventListener("online",t)})}var G="Tell the owner of this site: publishing it again should repair it.",V="Use a current Chrome, Edge or Firefox, or Safari 16.4 or newer",ue={"PTM-V101":`${V}, with hardware acceleration on.`,"PTM-V102":`${V}.`,"PTM-V103":G,"PTM-V104":"Check your connection and reload the page.","PTM-V106":"Update the browser, or allow this page to use web workers and more memory.","PTM-V105":G},me="Reload the page. If that does not help, tell the owner of this site.",j=8e3,pe=["nav","#panels","#view"];function k(i,{code:e,message:t}){let s=m(i,"#error"),n=m(i,"#again");m(i,"#error-text").textContent=t,m(i,"#error-remedy").textContent=ue[e]??me,m(i,"#error-code").textContent=e,m(i,"#loading").hidden=!0,s.hidden=!1;for(let r of pe)m(i,r).inert=!0;n.onclick=()=>location.reload(),n.focus()}function W(i,...e){let t=B("p",{},...e);m(i,"#notices").append(t);let s=()=>{t.contains(i.activeElement)?setTimeout(s,j):t.remove()};setTimeout(s,j)}var we=15,xe=5;async function H(i){let e=!1,t=!1,s=n=>{e=!0;let r=n instanceof u;k(document,r?n:new u("PTM-V107",String(n)))};try{let n=m(document,"canvas"),r=JSON.parse(m(document,"#site").textContent??""),h=n.getContext("webgl2",{antialias:!0,preserveDrawingBuffer:!1});if(!h)throw new u("PTM-V101","This browser cannot draw with WebGL 2.");let a=null,o=g();n.addEventListener("webglcontextlost",d=>{d.preventDefault(),t=!0;let E=()=>s(new u("PTM-V107","The graphics card has reset the page."));g()-o<xe?E():setTimeout(E,1e3*we)}),n.addEventListener("webglcontextrestored",()=>{e||(a?.address&&history.replaceState(null,"",a.address()),location.reload())});let c=new S(d=>W(document,d));a=await i(h,r,c,d=>{t||s(d)});let l=a;Object.assign(window,{ptm:a});let f=m(document,"#status"),w=g(),x=()=>{if(e||t)return;let d=g();try{Ee(n);let E=l.frame(Math.min(d-w,.1));f.textContent!==E&&(f.textContent=E)}catch(E){throw s(E),E}w=d,requestAnimationFrame(x)};requestAnimationFrame(x),document.body.classList.add("begun")}catch(n){s(n)}}function Ee(i){let e=Math.max(1,Math.round(i.clientWidth*devicePixelRatio)),t=Math.max(1,Math.round(i.clientHeight*devicePixelRatio));(i.width!==e||i.height!==t)&&Object.assign(i,{width:e,height:t})}function K(i,e,t){return i.whole(e,s=>t(JSON.parse(new TextDecoder("utf-8",{fatal:!0}).decode(s))))}var ge=Uint32Array.from({length:256},(i,e)=>{for(let t=0;t<8;t++)e=e&1?e>>>1^3988292384:e>>>1;return e});function F(i,e=0){let t=~e;for(let s=0;s<i.length;s++)t=ge[(t^i[s])&255]^t>>>8;return~t>>>0}var Ye=2**24;var qe=new Uint8Array([3,0]);function p(i,e){if(!i)throw new Error(e)}var y=(i,e,t)=>Number.isInteger(i)&&e<=i&&i<=t;var Y={png:"image/png",jpg:"image/jpeg",webp:"image/webp"},Te=65536,ve=2**30;function q(i){p(i?.format==="ptmtools interlaced image"&&i.schema===1,"not an index of an interlaced image");let{width:e,height:t,container:s,files:n,kind:r,original:h}=i,a=c=>y(c,1,Te);p(a(e)&&a(t)&&a(h?.width)&&a(h?.height),"no size"),p(s in Y&&(r==="uint8"||r==="uint16"),"another container"),p(Array.isArray(n)&&y(n.length,1,33),"no files");let o={width:0,height:0};return n.forEach((c,l)=>{let{axis:f,joined:w}=c;p(c.name===`${l+1}.${s}`,"a file of another name"),p(a(c.width)&&a(c.height),"a file without size"),p(y(c.bytes,1,9*c.width*c.height+2**20),"a file of too many bytes"),p(y(c.crc32,0,4294967295)&&(l?f==="columns"||f==="rows":f===null),"no axis");let[x,d]=l?f==="columns"?[2,1]:[1,2]:[1,1];l||(o={width:c.width,height:c.height}),p(c.width===o.width&&c.height===o.height,"a file of another size"),o={width:x*o.width,height:d*o.height},p(w?.width===o.width&&w?.height===o.height,"a step of another size")}),p(o.width===e&&o.height===t,"steps that do not make the image"),i}var Re=`#version 300 es
void main(){
gl_Position=vec4(4*(gl_VertexID & 1)-1,4*(gl_VertexID >> 1)-1,0,1);
}`,ye=`#version 300 es
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
}`,be={columns:[0,255,0,255],rows:[0,0,255,255],first:[255,255,255,255]};async function Ae(i,e){if(!e)return createImageBitmap(i,{colorSpaceConversion:"none"});let t=URL.createObjectURL(i),s=Object.assign(new Image,{src:t});return await s.decode().finally(()=>URL.revokeObjectURL(t)),s}function Me(i,{container:e},{bytes:t,crc32:s}){return p(i.length===t&&F(i)===s,"another checksum"),new Blob([i],{type:Y[e]})}async function Se(i,{components:e},{width:t,height:s}){let n=await Ae(i,e%2===0);return p(n.width===t&&n.height===s,"an image of another size"),n}var N=class{constructor(e){this.gl=e,this.use=M(e,"join",[Re,ye]),this.buffer=e.createFramebuffer(),this.patterns=Object.fromEntries(Object.entries(be).map(([t,s])=>{let n=this.#e(2,2,e.R8);for(let r of[e.TEXTURE_WRAP_S,e.TEXTURE_WRAP_T])e.texParameteri(e.TEXTURE_2D,r,e.REPEAT);return e.pixelStorei(e.UNPACK_ALIGNMENT,1),e.texSubImage2D(e.TEXTURE_2D,0,0,0,2,2,e.RED,e.UNSIGNED_BYTE,new Uint8Array(s)),[t,n]}))}upload(e){let{gl:t}=this,s=this.#e(e.width,e.height,t.RGBA8);return t.pixelStorei(t.UNPACK_PREMULTIPLY_ALPHA_WEBGL,!1),t.pixelStorei(t.UNPACK_COLORSPACE_CONVERSION_WEBGL,t.NONE),t.texSubImage2D(t.TEXTURE_2D,0,0,0,t.RGBA,t.UNSIGNED_BYTE,e),"close"in e&&e.close(),s}join({axis:e,joined:{width:t,height:s}},n,r,h=4,a=!1){let{gl:o,use:{program:c,at:l}}=this,f=a?1+Math.floor(Math.log2(Math.max(t,s))):1,w=this.#e(t,s,h===1?o.R8:h===2?o.RG8:o.RGBA8,f);o.bindFramebuffer(o.FRAMEBUFFER,this.buffer),o.framebufferTexture2D(o.FRAMEBUFFER,o.COLOR_ATTACHMENT0,o.TEXTURE_2D,w,0),o.viewport(0,0,t,s),o.disable(o.BLEND),o.useProgram(c);let x={before:n??r,next:r,pattern:this.patterns[e??"first"]};return Object.entries(x).forEach(([d,E],b)=>{o.activeTexture(o.TEXTURE0+b),o.bindTexture(o.TEXTURE_2D,E),E===n&&this.#t(o.NEAREST,o.NEAREST),o.uniform1i(l[d],b)}),o.activeTexture(o.TEXTURE0),o.uniform2f(l.size,t,s),o.uniform1i(l.pairs,+(h===2)),o.drawArrays(o.TRIANGLES,0,3),o.bindFramebuffer(o.FRAMEBUFFER,null),o.deleteTexture(n),o.deleteTexture(r),a&&(o.bindTexture(o.TEXTURE_2D,w),o.generateMipmap(o.TEXTURE_2D),this.#t(o.LINEAR_MIPMAP_LINEAR,o.LINEAR)),w}texels(e,t,s){let{gl:n}=this,r=new Uint8Array(4*t*s);return n.bindFramebuffer(n.FRAMEBUFFER,this.buffer),n.framebufferTexture2D(n.FRAMEBUFFER,n.COLOR_ATTACHMENT0,n.TEXTURE_2D,e,0),n.readPixels(0,0,t,s,n.RGBA,n.UNSIGNED_BYTE,r),n.bindFramebuffer(n.FRAMEBUFFER,null),r}#e(e,t,s,n=1){let{gl:r}=this,h=r.createTexture();r.bindTexture(r.TEXTURE_2D,h),r.texStorage2D(r.TEXTURE_2D,n,s,e,t),this.#t(r.NEAREST,r.NEAREST);for(let a of[r.TEXTURE_WRAP_S,r.TEXTURE_WRAP_T])r.texParameteri(r.TEXTURE_2D,a,r.CLAMP_TO_EDGE);return h}#t(e,t){this.gl.texParameteri(this.gl.TEXTURE_2D,this.gl.TEXTURE_MIN_FILTER,e),this.gl.texParameteri(this.gl.TEXTURE_2D,this.gl.TEXTURE_MAG_FILTER,t)}};function Ue(i,{files:e}){let t=i.getParameter(i.MAX_TEXTURE_SIZE),s=e.findIndex(({joined:{width:n,height:r}})=>Math.max(n,r)>t||4*n*r>ve);return s<0?e.length:s}var U=class{constructor(e,t,s,n){if(this.index=t,this.urlOf=s,this.fetcher=n,this.joiner=new N(e),this.texture=null,this.steps=0,this.running=!1,this.most=Ue(e,t),!this.most)throw new u("PTM-V101","The image is larger than this graphics card's textures.")}get size(){return this.steps?this.index.files[this.steps-1].joined:{width:0,height:0}}advance(e){this.running||this.steps===this.most||(this.running=!0,this.#e().then(()=>this.running=!1,e))}async#e(){let{index:e,joiner:t}=this,s=e.files[this.steps],n=await this.fetcher.whole(this.urlOf(s.name),h=>Se(Me(h,e,s),e,s)),r=t.upload(n);this.texture=s.axis?t.join(s,this.texture,r):r,this.steps++}texels(){let{width:e,height:t}=this.size;return this.joiner.texels(this.texture,e,t)}};var J={ArrowLeft:[1,0,0],ArrowRight:[-1,0,0],ArrowUp:[0,1,0],ArrowDown:[0,-1,0],Equal:[0,0,1],NumpadAdd:[0,0,1],Minus:[0,0,-1],NumpadSubtract:[0,0,-1]},_=class{#e=new Set;#t=new Map;constructor(e,t,s){this.canvas=e,this.width=t,this.height=s,this.scale=0,this.shift=[0,0],e.focus({preventScroll:!0}),e.addEventListener("pointerdown",n=>{n.button===0&&(e.setPointerCapture(n.pointerId),this.#t.set(n.pointerId,this.#n(n)))});for(let n of["pointerup","pointercancel"])e.addEventListener(n,r=>this.#t.delete(r.pointerId));e.addEventListener("pointermove",n=>this.#a(n)),e.addEventListener("wheel",n=>{n.preventDefault(),this.#i(Math.exp(-n.deltaY*.0015),this.#n(n))},{passive:!1}),e.addEventListener("keydown",n=>{if(n.ctrlKey||n.metaKey||n.altKey)return this.#e.clear();n.code in J&&(n.preventDefault(),this.#e.add(n.code))}),e.addEventListener("keyup",n=>this.#e.delete(n.code)),e.addEventListener("blur",()=>this.#e.clear())}get#s(){return Math.min(this.canvas.width/this.width,this.canvas.height/this.height)}get pixels(){return this.scale||this.#s}place(e,t=[0,0]){this.scale=e>0?this.#r(e):0;let s=[this.width,this.height].map(r=>r*this.pixels),n=[this.canvas.width,this.canvas.height];this.shift=t.map((r,h)=>Math.max(-1,Math.min(1,2*r/(s[h]+.8*n[h])))*(s[h]+.8*n[h])/2)}step(e){for(let t of this.#e){let[s,n,r]=J[t];r?this.#i(Math.exp(r*1.2*e),[0,0]):this.place(this.scale,[this.shift[0]+s*600*e,this.shift[1]+n*600*e])}}get box(){let{width:e,height:t}=this.canvas,{pixels:s,shift:[n,r]}=this,[h,a]=[this.width*s/e,this.height*s/t],[o,c]=[2*n/e,2*r/t];return[o-h,-c-a,o+h,-c+a]}#r(e){let t=this.#s;return Math.max(.25*Math.min(1,t),Math.min(Math.max(32,2*t),e))}#i(e,t){let s=this.pixels,n=this.#r(s*e);this.place(n,this.shift.map((r,h)=>t[h]+(r-t[h])*(n/s)))}#n({offsetX:e,offsetY:t}){let s=this.canvas.width/Math.max(1,this.canvas.clientWidth);return[e*s-this.canvas.width/2,t*s-this.canvas.height/2]}#a(e){if(!this.#t.get(e.pointerId))return;let{spread:s,middle:n}=this.#o();this.#t.set(e.pointerId,this.#n(e));let r=this.#o();this.place(this.scale,this.shift.map((h,a)=>h+r.middle[a]-n[a])),s>0&&r.spread>0&&this.#i(r.spread/s,r.middle)}#o(){let e=[...this.#t.values()],[t,s]=e;return{middle:[0,1].map(r=>e.reduce((h,a)=>h+a[r],0)/e.length),spread:s?Math.hypot(t[0]-s[0],t[1]-s[1]):0}}};var _e=`#version 300 es
uniform vec4 box;
out vec2 place;
void main(){
vec2 corner=vec2(gl_VertexID & 1,gl_VertexID >> 1);
place=vec2(corner.x,1.0-corner.y);
gl_Position=vec4(mix(box.xy,box.zw,corner),0,1);
}`,Pe=`#version 300 es
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
}`;H(async(i,e,t,s)=>{let n=new URL(e.index,location.href).href,r=R=>new URL(R,n).href,h=await K(t,n,q),a=new U(i,h,r,t),{width:o,height:c}=h.original,l=i.canvas,f=new _(l,o,c),w=new URLSearchParams(location.search).has("all"),{program:x,at:d}=M(i,"picture",[_e,Pe]),E=i.createVertexArray(),b=h.files.reduce((R,{bytes:v})=>R+v,0);m(document,"#keys").textContent="Drag or use the arrow keys to move; wheel, two fingers, + and − to zoom";let A=!0,$="",Z=()=>{i.viewport(0,0,i.drawingBufferWidth,i.drawingBufferHeight),i.clearColor(.086,.09,.106,1),i.clear(i.COLOR_BUFFER_BIT),a.texture&&(i.useProgram(x),i.bindVertexArray(E),i.activeTexture(i.TEXTURE0),i.bindTexture(i.TEXTURE_2D,a.texture),i.uniform1i(d.image,0),i.uniform4fv(d.box,f.box),i.drawArrays(i.TRIANGLE_STRIP,0,4))};return{frame(R){f.step(R);let{size:v}=a;A=w||!a.steps||v.width<f.pixels*o||v.height<f.pixels*c,A&&a.advance(s);let O=[l.width,l.height,...f.box,a.steps].join();O!==$&&Z(),$=O;let Q=h.files.slice(0,a.steps).reduce((ie,{bytes:ne})=>ie+ne,0),ee=a.steps===h.files.length?"":a.steps===a.most?"; more than this graphics card can hold":A?" …":"; finer ones when you zoom in",te=`${a.steps} of ${h.files.length} files, ${v.width} × ${v.height} of ${h.width} × ${h.height}`,se=h.kind==="uint16"?"; shown in 8 bits":"";return`${te}, ${I(Q)} of ${I(b)}${ee}${se}`},state:()=>({steps:a.steps,size:a.size,complete:a.steps===a.most,needed:A,pending:t.pending,requests:t.requests,bytes:t.bytes}),texels:()=>a.texels(),place:f.place.bind(f)}});
