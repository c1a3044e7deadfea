var U=(i="",e="")=>`#version 300 es
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
}`,ne=`
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
}`,re=`#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
in vec3 painted;
uniform float cutoff;
out vec4 shown;
${ne}
void main(){
vec4 sampled=texel();
float light=1.0;
if(!textured){
vec3 normal=cross(dFdx(seen),dFdy(seen));
float size=length(normal);
light=0.25+0.75*(size > 0.0?abs(dot(normal,normalize(seen)))/size:1.0);
sampled=vec4(1.0);
}
shown=vec4(sampled.rgb*color.rgb*painted*light,sampled.a*color.a);
if(shown.a < max(cutoff,0.004))discard;
if(cutoff > 0.0)shown.a=1.0;
}`,$=`
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
${$}
void main(){
float w=gl_FragCoord.w;
vec2 texels=uv*size;
vec2 across=(dFdx(texels*w)-texels*dFdx(w))/w;
vec2 up=(dFdy(texels*w)-texels*dFdy(w))/w;
float most=max(dot(across,across),dot(up,up));
float detail=0.5*log2(max(most,1e-30))-log2(pixels);
shown=vec4(bytes(item),bytes(floor(256.0*clamp(detail,0.0,31.0))));
}`,ae=`#version 300 es
precision highp float;
uniform float item;
layout(location=1)out vec4 shown;
${$}
void main(){shown=vec4(bytes(item),0.0,1.0);}`,O={surface:[U(),re],item:[U(),oe],placeholder:[U(),ae]};function b(i,e,t=O[e]){let s=i.createProgram(),r=[i.VERTEX_SHADER,i.FRAGMENT_SHADER];if(t.forEach((o,h)=>{let c=i.createShader(r[h]);i.shaderSource(c,o),i.compileShader(c),i.attachShader(s,c),i.deleteShader(c)}),i.linkProgram(s),!i.getProgramParameter(s,i.LINK_STATUS)&&!i.isContextLost())throw new Error(`${e}: ${i.getProgramInfoLog(s)}`);let n={},a=i.isContextLost()?0:i.getProgramParameter(s,i.ACTIVE_UNIFORMS);for(let o=0;o<a;o++){let h=i.getActiveUniform(s,o)?.name??"";n[h]=i.getUniformLocation(s,h)}return{program:s,at:n}}function m(i,e){let t=i.querySelector(e);if(!t)throw new Error(`the page has no ${e}`);return t}function N(i,e={},...t){let s=document.createElement(i);for(let[r,n]of Object.entries(e))r in s?Reflect.set(s,r,n):s.setAttribute(r,n);return s.append(...t),s}function _(i){let e=i<1e6?["kB",1e3]:["MB",1e6],t=i/Number(e[1]);return`${t.toFixed(t<10?1:0)} ${e[0]}`}var d=class extends Error{constructor(e,t){super(t),this.code=e}};var he=6,ce=.5,P=20,x=class extends Error{constructor(e,t=!1){super(e),this.anew=t}},E=()=>performance.now()/1e3,A=class{constructor(e){this.notice=e,this.measured=null,this.requests=0,this.bytes=0,this.pending=0,this.ignoresRanges=!1}whole(e,t,s,r="default"){return this.#e(e,r,s,async n=>{let{response:a,body:o}=await this.#s(e,{cache:n},s);if(a.status!==200)throw C(e,a.status);try{return await t(o)}catch(h){if(h instanceof d)throw h;let c=h.message;throw n==="default"?new x(c,!0):new d("PTM-V105",`${I(e)} is damaged: ${c}`)}})}range(e,t,s,r,n,a="default"){let o=`bytes=${t}-${s-1}`;return this.#e(e,a,n,async h=>{let{response:c,body:f}=await this.#s(e,{cache:h,headers:{range:o}},n);if(c.status===200){if(f.length!==r)throw new x(`${f.length} of ${r} bytes`,!0);return this.#t(),{begin:0,body:f}}if(c.status!==206)throw C(e,c.status);let l=c.headers.get("content-range")??`bytes ${t}-${s-1}/${r}`;if(l!==`bytes ${t}-${s-1}/${r}`||f.length!==s-t)throw new x(`${f.length} bytes, "${l}", in place of ${o}`,!0);return{begin:t,body:f}})}#t(){this.ignoresRanges||(this.ignoresRanges=!0,console.warn("This host ignores byte ranges: each texture is downloaded whole before it is seen."),this.notice("Textures load slowly here: the server does not support range requests."))}async#e(e,t,s,r){let n=s?.left??0,a="";for(let o=0;o<he;o++){o&&(s&&Object.assign(s,{left:0,waits:!0}),await fe(ce*2**(o-1))),s&&Object.assign(s,{left:n,waits:!1}),this.pending++;try{return await r(t)}catch(h){if(h instanceof d)throw h;h instanceof x&&h.anew&&(t="no-store"),a=String(h.message)}finally{this.pending--}}throw new d("PTM-V104",`${I(e)} cannot be downloaded: ${a}`)}async#s(e,t,s){this.requests++;let r=new AbortController,n=new x(`nothing came for ${P} s`),a=setTimeout(()=>r.abort(n),1e3*P);try{let o=E(),h=await fetch(e,{...t,signal:r.signal}),c=E(),f=h.body?.getReader(),l=[];for(;;){let{done:u,value:w}=await f?.read()??{done:!0,value:void 0};if(u||!w){let g=le(l);return this.measured?.(o,c,E(),g.length),{response:h,body:g}}clearTimeout(a),a=setTimeout(()=>r.abort(n),1e3*P),l.push(w),this.bytes+=w.length,s&&(s.left-=w.length)}}finally{clearTimeout(a)}}};function le(i){let e=new Uint8Array(i.reduce((s,{length:r})=>s+r,0)),t=0;for(let s of i)e.set(s,t),t+=s.length;return e}function C(i,e){if(e>=500||e===429||e===408)return new x(`status ${e}`);let t=e===404?"is missing":`is refused with status ${e}`;return new d("PTM-V103",`${I(i)} ${t} on this site`)}function I(i){return decodeURIComponent(new URL(i,location.href).pathname.split("/").pop()??i)}function fe(i){return new Promise(e=>{let t=()=>{clearTimeout(s),removeEventListener("online",t),e(void 0)},s=setTimeout(t,1e3*i);addEventListener("online",t)})}var B="Tell the owner of this site: publishing it again should repair it.",X="Use a current Chrome, Edge or Firefox, or Safari 16.4 or newer",de={"PTM-V101":`${X}, with hardware acceleration on.`,"PTM-V102":`${X}.`,"PTM-V103":B,"PTM-V104":"Check your connection and reload the page.","PTM-V106":"Update the browser, or allow this page to use web workers and more memory.","PTM-V105":B},ue="Reload the page. If that does not help, tell the owner of this site.",z=8e3,me=["nav","#panels","#view"];function G(i,{code:e,message:t}){let s=m(i,"#error"),r=m(i,"#again");m(i,"#error-text").textContent=t,m(i,"#error-remedy").textContent=de[e]??ue,m(i,"#error-code").textContent=e,m(i,"#loading").hidden=!0,s.hidden=!1;for(let n of me)m(i,n).inert=!0;r.onclick=()=>location.reload(),r.focus()}function V(i,...e){let t=N("p",{},...e);m(i,"#notices").append(t);let s=()=>{t.contains(i.activeElement)?setTimeout(s,z):t.remove()};setTimeout(s,z)}async function k(i){let e=!1,t=s=>{e=!0;let r=s instanceof d;G(document,r?s:new d("PTM-V107",String(s)))};try{let s=m(document,"canvas"),r=JSON.parse(m(document,"#site").textContent??""),n=s.getContext("webgl2",{antialias:!0,preserveDrawingBuffer:!1});if(!n)throw new d("PTM-V101","This browser cannot draw with WebGL 2.");s.addEventListener("webglcontextlost",l=>{l.preventDefault(),t(new d("PTM-V107","The graphics card has reset the page."))});let a=new A(l=>V(document,l)),o=await i(n,r,a,t);Object.assign(window,{ptm:o});let h=m(document,"#status"),c=E(),f=()=>{if(e)return;let l=E();try{pe(s);let u=o.frame(Math.min(l-c,.1));h.textContent!==u&&(h.textContent=u)}catch(u){throw t(u),u}c=l,requestAnimationFrame(f)};requestAnimationFrame(f),document.body.classList.add("begun")}catch(s){t(s)}}function pe(i){let e=Math.max(1,Math.round(i.clientWidth*devicePixelRatio)),t=Math.max(1,Math.round(i.clientHeight*devicePixelRatio));(i.width!==e||i.height!==t)&&Object.assign(i,{width:e,height:t})}function j(i,e,t){return i.whole(e,s=>t(JSON.parse(new TextDecoder("utf-8",{fatal:!0}).decode(s))))}var we=Uint32Array.from({length:256},(i,e)=>{for(let t=0;t<8;t++)e=e&1?e>>>1^3988292384:e>>>1;return e});function L(i,e=0){let t=~e;for(let s=0;s<i.length;s++)t=we[(t^i[s])&255]^t>>>8;return~t>>>0}var Ge=2**24;var Ve=new Uint8Array([3,0]);function p(i,e){if(!i)throw new Error(e)}var y=(i,e,t)=>Number.isInteger(i)&&e<=i&&i<=t;var W={png:"image/png",jpg:"image/jpeg",webp:"image/webp"},xe=65536;function H(i){p(i?.format==="ptmtools interlaced image"&&i.schema===1,"not an index of an interlaced image");let{width:e,height:t,container:s,files:r,kind:n,original:a}=i,o=c=>y(c,1,xe);p(o(e)&&o(t)&&o(a?.width)&&o(a?.height),"no size"),p(s in W&&(n==="uint8"||n==="uint16"),"another container"),p(Array.isArray(r)&&y(r.length,1,33),"no files");let h={width:0,height:0};return r.forEach((c,f)=>{let{axis:l,joined:u}=c;p(c.name===`${f+1}.${s}`,"a file of another name"),p(o(c.width)&&o(c.height)&&y(c.bytes,1,2**31),"a file without size"),p(y(c.crc32,0,4294967295)&&(f?l==="columns"||l==="rows":l===null),"no axis");let[w,g]=f?l==="columns"?[2,1]:[1,2]:[1,1];f||(h={width:c.width,height:c.height}),p(c.width===h.width&&c.height===h.height,"a file of another size"),h={width:w*h.width,height:g*h.height},p(u?.width===h.width&&u?.height===h.height,"a step of another size")}),p(h.width===e&&h.height===t,"steps that do not make the image"),i}var ge=`#version 300 es
void main(){
gl_Position=vec4(4*(gl_VertexID & 1)-1,4*(gl_VertexID >> 1)-1,0,1);
}`,Ee=`#version 300 es
precision highp float;
precision highp sampler2D;
uniform sampler2D before,next,pattern;
uniform vec2 size;
out vec4 texel;
void main(){
vec2 place=gl_FragCoord.xy/size;
texel=texture(pattern,place*size/2.0).r==0.0?texture(before,place):texture(next,place);
}`,Te={columns:[0,255,0,255],rows:[0,0,255,255]};async function ve(i,e){if(!e)return createImageBitmap(i,{colorSpaceConversion:"none"});let t=URL.createObjectURL(i),s=Object.assign(new Image,{src:t});return await s.decode().finally(()=>URL.revokeObjectURL(t)),s}var M=class{constructor(e,t,s,r){this.gl=e,this.index=t,this.urlOf=s,this.fetcher=r,this.use=b(e,"join",[ge,Ee]),this.buffer=e.createFramebuffer(),this.patterns=Object.fromEntries(Object.entries(Te).map(([o,h])=>{let c=this.#s(2,2,e.R8,e.REPEAT);return e.pixelStorei(e.UNPACK_ALIGNMENT,1),e.texSubImage2D(e.TEXTURE_2D,0,0,0,2,2,e.RED,e.UNSIGNED_BYTE,new Uint8Array(h)),[o,c]})),this.texture=null,this.steps=0,this.running=!1;let n=e.getParameter(e.MAX_TEXTURE_SIZE),a=t.files.findIndex(({joined:o})=>Math.max(o.width,o.height)>n);if(this.most=a<0?t.files.length:a,!this.most)throw new d("PTM-V101","The image is larger than this graphics card's textures.")}get size(){return this.steps?this.index.files[this.steps-1].joined:{width:0,height:0}}advance(e){this.running||this.steps===this.most||(this.running=!0,this.#t().then(()=>this.running=!1,e))}async#t(){let{gl:e}=this,t=this.index.files[this.steps],s=await this.fetcher.whole(this.urlOf(t.name),async n=>{p(n.length===t.bytes&&L(n)===t.crc32,"another checksum");let a=new Blob([n],{type:W[this.index.container]}),o=await ve(a,this.index.components%2===0);return p(o.width===t.width&&o.height===t.height,"an image of another size"),o}),r=this.#s(t.width,t.height,e.RGBA8,e.CLAMP_TO_EDGE);if(e.pixelStorei(e.UNPACK_PREMULTIPLY_ALPHA_WEBGL,!1),e.pixelStorei(e.UNPACK_COLORSPACE_CONVERSION_WEBGL,e.NONE),e.texSubImage2D(e.TEXTURE_2D,0,0,0,e.RGBA,e.UNSIGNED_BYTE,s),"close"in s&&s.close(),t.axis){let n=this.#e(t,r);e.deleteTexture(this.texture),e.deleteTexture(r),this.texture=n}else this.texture=r;this.steps++}#e({axis:e,joined:{width:t,height:s}},r){let{gl:n,use:{program:a,at:o}}=this,h=this.#s(t,s,n.RGBA8,n.CLAMP_TO_EDGE);n.bindFramebuffer(n.FRAMEBUFFER,this.buffer),n.framebufferTexture2D(n.FRAMEBUFFER,n.COLOR_ATTACHMENT0,n.TEXTURE_2D,h,0),n.viewport(0,0,t,s),n.disable(n.BLEND),n.useProgram(a);let c={before:this.texture,next:r,pattern:this.patterns[e]};return Object.entries(c).forEach(([f,l],u)=>{n.activeTexture(n.TEXTURE0+u),n.bindTexture(n.TEXTURE_2D,l),n.uniform1i(o[f],u)}),n.uniform2f(o.size,t,s),n.drawArrays(n.TRIANGLES,0,3),n.bindFramebuffer(n.FRAMEBUFFER,null),h}texels(){let{gl:e}=this,{width:t,height:s}=this.size,r=new Uint8Array(4*t*s);return e.bindFramebuffer(e.FRAMEBUFFER,this.buffer),e.framebufferTexture2D(e.FRAMEBUFFER,e.COLOR_ATTACHMENT0,e.TEXTURE_2D,this.texture,0),e.readPixels(0,0,t,s,e.RGBA,e.UNSIGNED_BYTE,r),e.bindFramebuffer(e.FRAMEBUFFER,null),r}#s(e,t,s,r){let{gl:n}=this,a=n.createTexture();n.bindTexture(n.TEXTURE_2D,a),n.texStorage2D(n.TEXTURE_2D,1,s,e,t);for(let o of[n.TEXTURE_MIN_FILTER,n.TEXTURE_MAG_FILTER])n.texParameteri(n.TEXTURE_2D,o,n.NEAREST);for(let o of[n.TEXTURE_WRAP_S,n.TEXTURE_WRAP_T])n.texParameteri(n.TEXTURE_2D,o,r);return a}};var K={ArrowLeft:[1,0,0],ArrowRight:[-1,0,0],ArrowUp:[0,1,0],ArrowDown:[0,-1,0],Equal:[0,0,1],NumpadAdd:[0,0,1],Minus:[0,0,-1],NumpadSubtract:[0,0,-1]},S=class{#t=new Set;#e=new Map;constructor(e,t,s){this.canvas=e,this.width=t,this.height=s,this.scale=0,this.shift=[0,0],e.focus({preventScroll:!0}),e.addEventListener("pointerdown",r=>{r.button===0&&(e.setPointerCapture(r.pointerId),this.#e.set(r.pointerId,this.#n(r)))});for(let r of["pointerup","pointercancel"])e.addEventListener(r,n=>this.#e.delete(n.pointerId));e.addEventListener("pointermove",r=>this.#a(r)),e.addEventListener("wheel",r=>{r.preventDefault(),this.#i(Math.exp(-r.deltaY*.0015),this.#n(r))},{passive:!1}),e.addEventListener("keydown",r=>{if(r.ctrlKey||r.metaKey||r.altKey)return this.#t.clear();r.code in K&&(r.preventDefault(),this.#t.add(r.code))}),e.addEventListener("keyup",r=>this.#t.delete(r.code)),e.addEventListener("blur",()=>this.#t.clear())}get#s(){return Math.min(this.canvas.width/this.width,this.canvas.height/this.height)}get pixels(){return this.scale||this.#s}place(e,t=[0,0]){this.scale=e>0?this.#r(e):0;let s=[this.width,this.height].map(n=>n*this.pixels),r=[this.canvas.width,this.canvas.height];this.shift=t.map((n,a)=>Math.max(-1,Math.min(1,2*n/(s[a]+.8*r[a])))*(s[a]+.8*r[a])/2)}step(e){for(let t of this.#t){let[s,r,n]=K[t];n?this.#i(Math.exp(n*1.2*e),[0,0]):this.place(this.scale,[this.shift[0]+s*600*e,this.shift[1]+r*600*e])}}get box(){let{width:e,height:t}=this.canvas,{pixels:s,shift:[r,n]}=this,[a,o]=[this.width*s/e,this.height*s/t],[h,c]=[2*r/e,2*n/t];return[h-a,-c-o,h+a,-c+o]}#r(e){let t=this.#s;return Math.max(.25*Math.min(1,t),Math.min(Math.max(32,2*t),e))}#i(e,t){let s=this.pixels,r=this.#r(s*e);this.place(r,this.shift.map((n,a)=>t[a]+(n-t[a])*(r/s)))}#n({offsetX:e,offsetY:t}){let s=this.canvas.width/Math.max(1,this.canvas.clientWidth);return[e*s-this.canvas.width/2,t*s-this.canvas.height/2]}#a(e){if(!this.#e.get(e.pointerId))return;let{spread:s,middle:r}=this.#o();this.#e.set(e.pointerId,this.#n(e));let n=this.#o();this.place(this.scale,this.shift.map((a,o)=>a+n.middle[o]-r[o])),s>0&&n.spread>0&&this.#i(n.spread/s,n.middle)}#o(){let e=[...this.#e.values()],[t,s]=e;return{middle:[0,1].map(n=>e.reduce((a,o)=>a+o[n],0)/e.length),spread:s?Math.hypot(t[0]-s[0],t[1]-s[1]):0}}};var ye=`#version 300 es
uniform vec4 box;
out vec2 place;
void main(){
vec2 corner=vec2(gl_VertexID & 1,gl_VertexID >> 1);
place=vec2(corner.x,1.0-corner.y);
gl_Position=vec4(mix(box.xy,box.zw,corner),0,1);
}`,Re=`#version 300 es
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
}`;k(async(i,e,t,s)=>{let r=new URL(e.index,location.href).href,n=v=>new URL(v,r).href,a=await j(t,r,H),o=new M(i,a,n,t),{width:h,height:c}=a.original,f=i.canvas,l=new S(f,h,c),u=new URLSearchParams(location.search).has("all"),{program:w,at:g}=b(i,"picture",[ye,Re]),Y=i.createVertexArray(),q=a.files.reduce((v,{bytes:T})=>v+T,0);m(document,"#keys").textContent="Drag or use the arrow keys to move; wheel, two fingers, + and − to zoom";let R=!0,D="",J=()=>{i.viewport(0,0,i.drawingBufferWidth,i.drawingBufferHeight),i.clearColor(.086,.09,.106,1),i.clear(i.COLOR_BUFFER_BIT),o.texture&&(i.useProgram(w),i.bindVertexArray(Y),i.activeTexture(i.TEXTURE0),i.bindTexture(i.TEXTURE_2D,o.texture),i.uniform1i(g.image,0),i.uniform4fv(g.box,l.box),i.drawArrays(i.TRIANGLE_STRIP,0,4))};return{frame(v){l.step(v);let{size:T}=o;R=u||!o.steps||T.width<l.pixels*h||T.height<l.pixels*c,R&&o.advance(s);let F=[f.width,f.height,...l.box,o.steps].join();F!==D&&J(),D=F;let Z=a.files.slice(0,o.steps).reduce((se,{bytes:ie})=>se+ie,0),Q=o.steps===a.files.length?"":o.steps===o.most?"; more than this graphics card can hold":R?" …":"; finer ones when you zoom in",ee=`${o.steps} of ${a.files.length} files, ${T.width} × ${T.height} of ${a.width} × ${a.height}`,te=a.kind==="uint16"?"; shown in 8 bits":"";return`${ee}, ${_(Z)} of ${_(q)}${Q}${te}`},state:()=>({steps:o.steps,size:o.size,complete:o.steps===o.most,needed:R,pending:t.pending,requests:t.requests,bytes:t.bytes}),texels:()=>o.texels(),place:l.place.bind(l)}});
