var I=(s="",e="")=>`#version 300 es
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
}`,ae=`
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
}`,he=`#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
in vec2 spot;
in vec3 painted;
uniform float cutoff;
uniform sampler2D lightmap;
uniform float lit;
out vec4 shown;
${ae}
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
}`,X=`
vec2 bytes(float number) {
  float high = floor(number / 256.0);
  return vec2(number - 256.0 * high, high) / 255.0;
}`,ce=`#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
uniform float item;
uniform vec2 size;
uniform float pixels;
out vec4 shown;
${X}
void main(){
float w=gl_FragCoord.w;
vec2 texels=uv*size;
vec2 across=(dFdx(texels*w)-texels*dFdx(w))/w;
vec2 up=(dFdy(texels*w)-texels*dFdy(w))/w;
float most=max(dot(across,across),dot(up,up));
float detail=0.5*log2(max(most,1e-30))-log2(pixels);
shown=vec4(bytes(item),bytes(floor(256.0*clamp(detail,0.0,31.0))));
}`,le=`#version 300 es
precision highp float;
uniform float item;
layout(location=1)out vec4 shown;
${X}
void main(){shown=vec4(bytes(item),0.0,1.0);}`,k={surface:[I(`
layout(location = 3) in vec2 place2;
out vec2 spot;`,"spot = place2;"),he],item:[I(),ce],placeholder:[I(),le]};function S(s,e,t=k[e]){let i=s.createProgram(),n=[s.VERTEX_SHADER,s.FRAGMENT_SHADER];if(t.forEach((a,o)=>{let c=s.createShader(n[o]);s.shaderSource(c,a),s.compileShader(c),s.attachShader(i,c),s.deleteShader(c)}),s.linkProgram(i),!s.getProgramParameter(i,s.LINK_STATUS)&&!s.isContextLost())throw new Error(`${e}: ${s.getProgramInfoLog(i)}`);let r={},h=s.isContextLost()?0:s.getProgramParameter(i,s.ACTIVE_UNIFORMS);for(let a=0;a<h;a++){let o=s.getActiveUniform(i,a)?.name??"";r[o]=s.getUniformLocation(i,o)}return{program:i,at:r}}function u(s,e){let t=s.querySelector(e);if(!t)throw new Error(`the page has no ${e}`);return t}function B(s,e={},...t){let i=document.createElement(s);for(let[n,r]of Object.entries(e))n in i?Reflect.set(i,n,r):i.setAttribute(n,r);return i.append(...t),i}function L(s){let e=s<1e6?["kB",1e3]:["MB",1e6],t=s/Number(e[1]);return`${t.toFixed(t<10?1:0)} ${e[0]}`}function z(s){let e={antialias:!0,failIfMajorPerformanceCaveat:!0},t={antialias:!1};return s.getContext("webgl2",e)??s.getContext("webgl2",t)}var d=class extends Error{constructor(e,t){super(t),this.code=e}};var fe=6,de=.5,D=20,v=class extends Error{constructor(e,t=!1){super(e),this.anew=t}},T=()=>performance.now()/1e3,M=class{constructor(e){this.notice=e,this.measured=null,this.requests=0,this.bytes=0,this.pending=0,this.ignoresRanges=!1}whole(e,t,i,n="default"){return this.#t(e,n,i,async r=>{let{response:h,body:a}=await this.#s(e,{cache:r},i);if(h.status!==200)throw j(e,h.status);try{return await t(a)}catch(o){if(o instanceof d)throw o;let c=o.message;throw r==="default"?new v(c,!0):new d("PTM-V105",`${F(e)} is damaged: ${c}`)}})}range(e,t,i,n,r,h="default"){let a=`bytes=${t}-${i-1}`;return this.#t(e,h,r,async o=>{let{response:c,body:f}=await this.#s(e,{cache:o,headers:{range:a}},r);if(c.status===200){if(f.length!==n)throw new v(`${f.length} of ${n} bytes`,!0);return this.#e(),{begin:0,body:f}}if(c.status!==206)throw j(e,c.status);let l=c.headers.get("content-range")??`bytes ${t}-${i-1}/${n}`;if(l!==`bytes ${t}-${i-1}/${n}`||f.length!==i-t)throw new v(`${f.length} bytes, "${l}", in place of ${a}`,!0);return{begin:t,body:f}})}#e(){this.ignoresRanges||(this.ignoresRanges=!0,console.warn("This host ignores byte ranges: each texture is downloaded whole before it is seen."),this.notice("Textures load slowly here: the server does not support range requests."))}async#t(e,t,i,n){let r=i?.left??0,h="";for(let a=0;a<fe;a++){a&&(i&&Object.assign(i,{left:0,waits:!0}),await me(de*2**(a-1))),i&&Object.assign(i,{left:r,waits:!1}),this.pending++;try{return await n(t)}catch(o){if(o instanceof d)throw o;o instanceof v&&o.anew&&(t="no-store"),h=String(o.message)}finally{this.pending--}}throw new d("PTM-V104",`${F(e)} cannot be downloaded: ${h}`)}async#s(e,t,i){this.requests++;let n=new AbortController,r=new v(`nothing came for ${D} s`),h=setTimeout(()=>n.abort(r),1e3*D);try{let a=T(),o=await fetch(e,{...t,signal:n.signal}),c=T(),f=o.body?.getReader(),l=[];for(;;){let{done:m,value:w}=await f?.read()??{done:!0,value:void 0};if(m||!w){let E=ue(l);return this.measured?.(a,c,T(),E.length),{response:o,body:E}}clearTimeout(h),h=setTimeout(()=>n.abort(r),1e3*D),l.push(w),this.bytes+=w.length,i&&(i.left-=w.length)}}finally{clearTimeout(h)}}};function ue(s){let e=new Uint8Array(s.reduce((i,{length:n})=>i+n,0)),t=0;for(let i of s)e.set(i,t),t+=i.length;return e}function j(s,e){if(e>=500||e===429||e===408)return new v(`status ${e}`);let t=e===404?"is missing":`is refused with status ${e}`;return new d("PTM-V103",`${F(s)} ${t} on this site`)}function F(s){return decodeURIComponent(new URL(s,location.href).pathname.split("/").pop()??s)}function me(s){return new Promise(e=>{let t=()=>{clearTimeout(i),removeEventListener("online",t),e(void 0)},i=setTimeout(t,1e3*s);addEventListener("online",t)})}var G="Tell the owner of this site: publishing it again should repair it.",V="Use a current Chrome, Edge or Firefox, or Safari 16.4 or newer",pe={"PTM-V101":`${V}, with hardware acceleration on.`,"PTM-V102":`${V}.`,"PTM-V103":G,"PTM-V104":"Check your connection and reload the page.","PTM-V106":"Update the browser, or allow this page to use web workers and more memory.","PTM-V105":G},we="Reload the page. If that does not help, tell the owner of this site.",W=8e3,xe=["nav","#panels","#view"];function H(s,{code:e,message:t}){let i=u(s,"#error"),n=u(s,"#again");u(s,"#error-text").textContent=t,u(s,"#error-remedy").textContent=pe[e]??we,u(s,"#error-code").textContent=e,u(s,"#loading").hidden=!0,i.hidden=!1;for(let r of xe)u(s,r).inert=!0;n.onclick=()=>location.reload(),n.focus()}function K(s,...e){let t=B("p",{},...e);u(s,"#notices").append(t);let i=()=>{t.contains(s.activeElement)?setTimeout(i,W):t.remove()};setTimeout(i,W)}var ge=s=>Math.round(s*1e5)/1e5,U=class{#e=[];#t=T();constructor(e,t){this.canvas=e,this.look=t}frame(){let{eye:e,direction:t}=this.look(),n=[this.#e.length?T()-this.#t:0,...Array.from(e),...Array.from(t)].map(ge);(!this.#e.length||n[0]>this.#e[this.#e.length-1][0])&&this.#e.push(n)}get document(){let{canvas:{width:e,height:t}}=this;return{format:"ptmtools walk",schema:1,fieldOfView:this.look().angle,aspect:e/t,samples:this.#e}}};var Ee=15,Te=5;async function Y(s){let e=!1,t=!1,i=n=>{e=!0;let r=n instanceof d;H(document,r?n:new d("PTM-V107",String(n)))};try{let n=u(document,"canvas"),r=JSON.parse(u(document,"#site").textContent??""),h=z(n);if(!h)throw new d("PTM-V101","This browser cannot draw with WebGL 2.");let a=null,o=T();n.addEventListener("webglcontextlost",x=>{x.preventDefault(),t=!0;let g=()=>i(new d("PTM-V107","The graphics card has reset the page."));T()-o<Te?g():setTimeout(g,1e3*Ee)}),n.addEventListener("webglcontextrestored",()=>{e||(a?.address&&history.replaceState(null,"",a.address()),location.reload())});let c=new M(x=>K(document,x));a=await s(h,r,c,x=>{t||i(x)});let f=a,{look:l}=a,m=null;l&&Object.defineProperties(a,{record:{value:()=>m=new U(n,l)},recording:{get:()=>m?.document??null}}),Object.assign(window,{ptm:a});let w=u(document,"#status"),E=T(),y=()=>{if(e||t)return;let x=T();try{ve(n);let g=f.frame(Math.min(x-E,.1));m?.frame(),w.textContent!==g&&(w.textContent=g)}catch(g){throw i(g),g}E=x,requestAnimationFrame(y)};requestAnimationFrame(y),document.body.classList.add("begun"),addEventListener("keydown",()=>document.body.classList.add("keys"),{once:!0})}catch(n){i(n)}}function ve(s){let e=Math.max(1,Math.round(s.clientWidth*devicePixelRatio)),t=Math.max(1,Math.round(s.clientHeight*devicePixelRatio));(s.width!==e||s.height!==t)&&Object.assign(s,{width:e,height:t})}function q(s,e,t){return s.whole(e,i=>t(JSON.parse(new TextDecoder("utf-8",{fatal:!0}).decode(i))))}var ye=Uint32Array.from({length:256},(s,e)=>{for(let t=0;t<8;t++)e=e&1?e>>>1^3988292384:e>>>1;return e});function O(s,e=0){let t=~e;for(let i=0;i<s.length;i++)t=ye[(t^s[i])&255]^t>>>8;return~t>>>0}var it=2**24;var nt=new Uint8Array([3,0]);function p(s,e){if(!s)throw new Error(e)}var A=(s,e,t)=>Number.isInteger(s)&&e<=s&&s<=t;var J={png:"image/png",jpg:"image/jpeg",webp:"image/webp"},Re=65536,be=2**30;function Z(s){p(s?.format==="ptmtools interlaced image"&&s.schema===1,"not an index of an interlaced image");let{width:e,height:t,container:i,files:n,kind:r,original:h}=s,a=c=>A(c,1,Re);p(a(e)&&a(t)&&a(h?.width)&&a(h?.height),"no size"),p(i in J&&(r==="uint8"||r==="uint16"),"another container"),p(Array.isArray(n)&&A(n.length,1,33),"no files");let o={width:0,height:0};return n.forEach((c,f)=>{let{axis:l,joined:m}=c;p(c.name===`${f+1}.${i}`,"a file of another name"),p(a(c.width)&&a(c.height),"a file without size"),p(A(c.bytes,1,9*c.width*c.height+2**20),"a file of too many bytes"),p(A(c.crc32,0,4294967295)&&(f?l==="columns"||l==="rows":l===null),"no axis");let[w,E]=f?l==="columns"?[2,1]:[1,2]:[1,1];f||(o={width:c.width,height:c.height}),p(c.width===o.width&&c.height===o.height,"a file of another size"),o={width:w*o.width,height:E*o.height},p(m?.width===o.width&&m?.height===o.height,"a step of another size")}),p(o.width===e&&o.height===t,"steps that do not make the image"),s}var Ae=`#version 300 es
void main(){
gl_Position=vec4(4*(gl_VertexID & 1)-1,4*(gl_VertexID >> 1)-1,0,1);
}`,Se=`#version 300 es
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
}`,Me={columns:[0,255,0,255],rows:[0,0,255,255],first:[255,255,255,255]};async function Ue(s,e){if(!e)return createImageBitmap(s,{colorSpaceConversion:"none"});let t=URL.createObjectURL(s),i=Object.assign(new Image,{src:t});return await i.decode().finally(()=>URL.revokeObjectURL(t)),i}function _e(s,{container:e},{bytes:t,crc32:i}){return p(s.length===t&&O(s)===i,"another checksum"),new Blob([s],{type:J[e]})}async function Pe(s,{components:e},{width:t,height:i}){let n=await Ue(s,e%2===0);return p(n.width===t&&n.height===i,"an image of another size"),n}var N=class{constructor(e){this.gl=e,this.use=S(e,"join",[Ae,Se]),this.buffer=e.createFramebuffer(),this.patterns=Object.fromEntries(Object.entries(Me).map(([t,i])=>{let n=this.#e(2,2,e.R8);for(let r of[e.TEXTURE_WRAP_S,e.TEXTURE_WRAP_T])e.texParameteri(e.TEXTURE_2D,r,e.REPEAT);return e.pixelStorei(e.UNPACK_ALIGNMENT,1),e.texSubImage2D(e.TEXTURE_2D,0,0,0,2,2,e.RED,e.UNSIGNED_BYTE,new Uint8Array(i)),[t,n]}))}upload(e){let{gl:t}=this,i=this.#e(e.width,e.height,t.RGBA8);return t.pixelStorei(t.UNPACK_PREMULTIPLY_ALPHA_WEBGL,!1),t.pixelStorei(t.UNPACK_COLORSPACE_CONVERSION_WEBGL,t.NONE),t.texSubImage2D(t.TEXTURE_2D,0,0,0,t.RGBA,t.UNSIGNED_BYTE,e),"close"in e&&e.close(),i}join({axis:e,joined:{width:t,height:i}},n,r,h=4,a=!1){let{gl:o,use:{program:c,at:f}}=this,l=a?1+Math.floor(Math.log2(Math.max(t,i))):1,m=this.#e(t,i,h===1?o.R8:h===2?o.RG8:o.RGBA8,l);o.bindFramebuffer(o.FRAMEBUFFER,this.buffer),o.framebufferTexture2D(o.FRAMEBUFFER,o.COLOR_ATTACHMENT0,o.TEXTURE_2D,m,0),o.viewport(0,0,t,i),o.disable(o.BLEND),o.useProgram(c);let w={before:n??r,next:r,pattern:this.patterns[e??"first"]};return Object.entries(w).forEach(([E,y],x)=>{o.activeTexture(o.TEXTURE0+x),o.bindTexture(o.TEXTURE_2D,y),y===n&&this.#t(o.NEAREST,o.NEAREST),o.uniform1i(f[E],x)}),o.activeTexture(o.TEXTURE0),o.uniform2f(f.size,t,i),o.uniform1i(f.pairs,+(h===2)),o.drawArrays(o.TRIANGLES,0,3),o.bindFramebuffer(o.FRAMEBUFFER,null),o.deleteTexture(n),o.deleteTexture(r),a&&(o.bindTexture(o.TEXTURE_2D,m),o.generateMipmap(o.TEXTURE_2D),this.#t(o.LINEAR_MIPMAP_LINEAR,o.LINEAR)),m}texels(e,t,i){let{gl:n}=this,r=new Uint8Array(4*t*i);return n.bindFramebuffer(n.FRAMEBUFFER,this.buffer),n.framebufferTexture2D(n.FRAMEBUFFER,n.COLOR_ATTACHMENT0,n.TEXTURE_2D,e,0),n.readPixels(0,0,t,i,n.RGBA,n.UNSIGNED_BYTE,r),n.bindFramebuffer(n.FRAMEBUFFER,null),r}#e(e,t,i,n=1){let{gl:r}=this,h=r.createTexture();r.bindTexture(r.TEXTURE_2D,h),r.texStorage2D(r.TEXTURE_2D,n,i,e,t),this.#t(r.NEAREST,r.NEAREST);for(let a of[r.TEXTURE_WRAP_S,r.TEXTURE_WRAP_T])r.texParameteri(r.TEXTURE_2D,a,r.CLAMP_TO_EDGE);return h}#t(e,t){this.gl.texParameteri(this.gl.TEXTURE_2D,this.gl.TEXTURE_MIN_FILTER,e),this.gl.texParameteri(this.gl.TEXTURE_2D,this.gl.TEXTURE_MAG_FILTER,t)}};function Ie(s,{files:e}){let t=s.getParameter(s.MAX_TEXTURE_SIZE),i=e.findIndex(({joined:{width:n,height:r}})=>Math.max(n,r)>t||4*n*r>be);return i<0?e.length:i}var _=class{constructor(e,t,i,n){if(this.index=t,this.urlOf=i,this.fetcher=n,this.joiner=new N(e),this.texture=null,this.steps=0,this.running=!1,this.most=Ie(e,t),!this.most)throw new d("PTM-V101","The image is larger than this graphics card's textures.")}get size(){return this.steps?this.index.files[this.steps-1].joined:{width:0,height:0}}advance(e){this.running||this.steps===this.most||(this.running=!0,this.#e().then(()=>this.running=!1,e))}async#e(){let{index:e,joiner:t}=this,i=e.files[this.steps],n=await this.fetcher.whole(this.urlOf(i.name),h=>Pe(_e(h,e,i),e,i)),r=t.upload(n);this.texture=i.axis?t.join(i,this.texture,r):r,this.steps++}texels(){let{width:e,height:t}=this.size;return this.joiner.texels(this.texture,e,t)}};var Q={ArrowLeft:[1,0,0],ArrowRight:[-1,0,0],ArrowUp:[0,1,0],ArrowDown:[0,-1,0],Equal:[0,0,1],NumpadAdd:[0,0,1],Minus:[0,0,-1],NumpadSubtract:[0,0,-1]},P=class{#e=new Set;#t=new Map;constructor(e,t,i){this.canvas=e,this.width=t,this.height=i,this.scale=0,this.shift=[0,0],e.focus({preventScroll:!0}),e.addEventListener("pointerdown",n=>{n.button===0&&(e.setPointerCapture(n.pointerId),this.#t.set(n.pointerId,this.#n(n)))});for(let n of["pointerup","pointercancel"])e.addEventListener(n,r=>this.#t.delete(r.pointerId));e.addEventListener("pointermove",n=>this.#a(n)),e.addEventListener("wheel",n=>{n.preventDefault(),this.#i(Math.exp(-n.deltaY*.0015),this.#n(n))},{passive:!1}),e.addEventListener("keydown",n=>{if(n.ctrlKey||n.metaKey||n.altKey)return this.#e.clear();n.code in Q&&(n.preventDefault(),this.#e.add(n.code))}),e.addEventListener("keyup",n=>this.#e.delete(n.code)),e.addEventListener("blur",()=>this.#e.clear())}get#s(){return Math.min(this.canvas.width/this.width,this.canvas.height/this.height)}get pixels(){return this.scale||this.#s}place(e,t=[0,0]){this.scale=e>0?this.#r(e):0;let i=[this.width,this.height].map(r=>r*this.pixels),n=[this.canvas.width,this.canvas.height];this.shift=t.map((r,h)=>Math.max(-1,Math.min(1,2*r/(i[h]+.8*n[h])))*(i[h]+.8*n[h])/2)}step(e){for(let t of this.#e){let[i,n,r]=Q[t];r?this.#i(Math.exp(r*1.2*e),[0,0]):this.place(this.scale,[this.shift[0]+i*600*e,this.shift[1]+n*600*e])}}get box(){let{width:e,height:t}=this.canvas,{pixels:i,shift:[n,r]}=this,[h,a]=[this.width*i/e,this.height*i/t],[o,c]=[2*n/e,2*r/t];return[o-h,-c-a,o+h,-c+a]}#r(e){let t=this.#s;return Math.max(.25*Math.min(1,t),Math.min(Math.max(32,2*t),e))}#i(e,t){let i=this.pixels,n=this.#r(i*e);this.place(n,this.shift.map((r,h)=>t[h]+(r-t[h])*(n/i)))}#n({offsetX:e,offsetY:t}){let i=this.canvas.width/Math.max(1,this.canvas.clientWidth);return[e*i-this.canvas.width/2,t*i-this.canvas.height/2]}#a(e){if(!this.#t.get(e.pointerId))return;let{spread:i,middle:n}=this.#o();this.#t.set(e.pointerId,this.#n(e));let r=this.#o();this.place(this.scale,this.shift.map((h,a)=>h+r.middle[a]-n[a])),i>0&&r.spread>0&&this.#i(r.spread/i,r.middle)}#o(){let e=[...this.#t.values()],[t,i]=e;return{middle:[0,1].map(r=>e.reduce((h,a)=>h+a[r],0)/e.length),spread:i?Math.hypot(t[0]-i[0],t[1]-i[1]):0}}};var Le=`#version 300 es
uniform vec4 box;
out vec2 place;
void main(){
vec2 corner=vec2(gl_VertexID & 1,gl_VertexID >> 1);
place=vec2(corner.x,1.0-corner.y);
gl_Position=vec4(mix(box.xy,box.zw,corner),0,1);
}`,De=`#version 300 es
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
}`;Y(async(s,e,t,i)=>{let n=new URL(e.index,location.href).href,r=b=>new URL(b,n).href,h=await q(t,n,Z),a=new _(s,h,r,t),{width:o,height:c}=h.original,f=s.canvas,l=new P(f,o,c),m=new URLSearchParams(location.search).has("all"),{program:w,at:E}=S(s,"picture",[Le,De]),y=s.createVertexArray(),x=h.files.reduce((b,{bytes:R})=>b+R,0);u(document,"#keys").textContent="Drag or use the arrow keys to move; wheel, two fingers, + and − to zoom";let g=!0,$="",ee=()=>{s.viewport(0,0,s.drawingBufferWidth,s.drawingBufferHeight),s.clearColor(.086,.09,.106,1),s.clear(s.COLOR_BUFFER_BIT),a.texture&&(s.useProgram(w),s.bindVertexArray(y),s.activeTexture(s.TEXTURE0),s.bindTexture(s.TEXTURE_2D,a.texture),s.uniform1i(E.image,0),s.uniform4fv(E.box,l.box),s.drawArrays(s.TRIANGLE_STRIP,0,4))};return{frame(b){l.step(b);let{size:R}=a;g=m||!a.steps||R.width<l.pixels*o||R.height<l.pixels*c,g&&a.advance(i);let C=[f.width,f.height,...l.box,a.steps].join();C!==$&&ee(),$=C;let te=h.files.slice(0,a.steps).reduce((re,{bytes:oe})=>re+oe,0),se=a.steps===h.files.length?"":a.steps===a.most?"; more than this graphics card can hold":g?" …":"; finer ones when you zoom in",ie=`${a.steps} of ${h.files.length} files, ${R.width} × ${R.height} of ${h.width} × ${h.height}`,ne=h.kind==="uint16"?"; shown in 8 bits":"";return`${ie}, ${L(te)} of ${L(x)}${se}${ne}`},state:()=>({steps:a.steps,size:a.size,pixels:l.pixels,shift:l.shift,complete:a.steps===a.most,needed:g,pending:t.pending,requests:t.requests,bytes:t.bytes}),texels:()=>a.texels(),place:l.place.bind(l)}});
